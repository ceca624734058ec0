"""From a capture to the recovered room: settings, stages, files, the panels Capture and Recover."""
