"""From K to rates: ladders of K, blocks of cycles, evaluation, uncertainty."""
