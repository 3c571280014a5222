"""The controller board RCB-4HV: its protocol, a strict client, and a board without hardware."""
