"""The largest pushes that the standing robot survives."""
