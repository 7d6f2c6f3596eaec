"""Level sets of a crack, and the mesh cut by them."""
