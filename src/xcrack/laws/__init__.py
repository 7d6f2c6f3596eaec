"""Growth laws, closures and thresholds: values that are called, and presets with their sources."""
