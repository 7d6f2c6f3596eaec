"""Meshes whose cells are as small as a wanted error of K asks for."""
