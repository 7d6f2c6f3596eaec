"""Cut cells, enriched functions, quadrature and matrices."""
