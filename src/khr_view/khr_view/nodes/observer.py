"""Show a run on the page of this process."""

from __future__ import annotations

from threading import Event

from rclpy.experimental.events_executor import EventsExecutor

from khr_view.live_page import LivePage
from khr_view.node_specs import PAGE
from khr_view.nodes.page import PageNode


def observe(page: LivePage, stop: Event) -> None:
    """Show the present run until ``stop`` is set; ROS is up meanwhile."""
    executor = EventsExecutor()
    node = PageNode(PAGE, page)
    executor.add_node(node)
    try:
        while not stop.is_set():
            executor.spin_once(0.05)
        node.close()
    finally:
        executor.shutdown()
        node.destroy_node()
