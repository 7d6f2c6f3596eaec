"""What a user states: material, loads, supports, choices of method, and the problem."""
