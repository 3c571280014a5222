"""The KONDO KHR-3HV as a URDF: links, joints, masses and limits."""
