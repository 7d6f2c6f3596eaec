"""Lives with an error bar: scatter, percentiles, inspections, probability of detection."""
