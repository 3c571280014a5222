"""The page in viser: scene, charts, controls, and its server."""
