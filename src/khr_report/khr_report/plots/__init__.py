"""What all figures share: style, and the points beside a picture."""
