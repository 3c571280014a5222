"""The page as viser shows it: the scene, the charts, the controls, and who may open them."""
