"""The part of this package that needs ROS: base class of the nodes, messages, executor."""
