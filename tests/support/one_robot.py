"""A world with one robot, whose states and targets are no lists."""

from khr_sim.physics import world


class World:
    """A world with one robot; the rest is that of :class:`khr_sim.physics.world.World`."""

    def __init__(self, parameters):
        self._world = world.World([parameters])
        (self.body,) = self._world.bodies

    def __getattr__(self, name):
        return getattr(self._world, name)

    def reset(self, posture, clearance=0.0):
        (truth,) = self._world.reset([posture], clearance)
        return truth

    def advance(self, target):
        (truth,) = self._world.advance([target])
        return truth

    def configure(self, parameters):
        self._world.configure([parameters])
