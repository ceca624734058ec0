"""Result folders: their location, their content, their images in an open file, finding moved ones."""
