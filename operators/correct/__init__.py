"""What the artist says of objects, and the refit that follows."""
