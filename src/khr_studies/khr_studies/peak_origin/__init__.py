"""The origin of spectral peaks: gait, feedback or slipping."""
