"""What every package needs: arrays, errors, checked input, threads, optional packages."""
