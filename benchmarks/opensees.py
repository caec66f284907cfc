"""One stiffness matrix in OpenSeesPy, as fast as it goes: one model, one factorisation, six loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.opensees_model import CENTRE, build


def stiffness_once(name: str, rotation: str, centre: np.ndarray, turn: np.ndarray) -> Any:
    """6 x 6 stiffness at the platform centre."""
    import openseespy.opensees as ops

    build(name, rotation, centre, turn)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("BandGeneral")
    ops.algorithm("Linear", False, False, True)  # factor once
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    columns = []
    for k, unit in enumerate(np.eye(6), 1):
        ops.timeSeries("Linear", k)
        ops.pattern("Plain", k, k)
        ops.load(CENTRE, *map(float, unit))
        ops.analyze(1)
        columns.append(ops.nodeDisp(CENTRE))
        ops.remove("loadPattern", k)
        ops.reset()
    return np.linalg.inv(np.array(columns).T)
