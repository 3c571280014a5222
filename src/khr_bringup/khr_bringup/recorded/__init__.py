"""Read, repair and repeat recorded runs."""
