"""What the user states: material, loads, supports, choices of method, and the problem they make."""
