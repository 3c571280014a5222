"""A vibratory MEMS gyro modelled down to its circuit, after Dutta (2021), chapter 4.

- ``circuit``: its constants, each with its source, and closed-form results;
- ``carrier``: the whole chain at the carrier's time scale, as waveforms;
- ``baseband``: the same sensor as a linear system at the control rate, cheap enough for a node;
- ``report``: the numbers of its document, and how far those two are apart.
"""
