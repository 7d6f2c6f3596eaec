"""What happens on the way: cracks that meet, arrivals at the boundary, ligaments, ends."""
