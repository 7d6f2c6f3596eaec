"""Many runs of one case: on the processors of a machine, or on any client that takes tasks."""
