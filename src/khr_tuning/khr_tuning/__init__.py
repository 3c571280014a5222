"""What the feedback loops do, and which gains to choose for a slope."""
