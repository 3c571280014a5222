"""What of this package needs ROS: the base class of the nodes, their messages, their executor."""
