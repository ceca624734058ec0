"""What the artist says of objects, what no frame saw, and a refit brought into the file."""
