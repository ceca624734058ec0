"""Result folders: where they go, what they say, their images in an open file, finding them again."""
