"""Meshes that choose themselves: refined until the errors of K are as small as wanted."""
