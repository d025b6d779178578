"""A first grasp written into the text of a problem file, which is left as it is otherwise: comments and order too."""

from __future__ import annotations

import json
import re

from graspatlas.errors import GraspAtlasError
from graspatlas.problem.first_grasp import FirstGrasp
from graspatlas.problem_files import documents

__all__ = ["with_x1"]

#: Digits of positions: more than the contacts need.
DIGITS = 12


def with_x1(text: str, x1: FirstGrasp) -> str:
    """The text of a problem file that states no first grasp, with one.

    Args:
        text: YAML or JSON.
        x1: The first grasp.

    Raises:
        GraspAtlasError: If the file states one already, or cannot be added to.
    """
    data = documents.parse(text).data
    if not isinstance(data, dict) or data.get("x1") is not None:
        raise GraspAtlasError("the problem file states an x1 already: remove it to have another one written")
    table = {name: value for name, value in x1.to_dict().items() if value is not None}
    if text.lstrip().startswith("{"):
        try:
            return json.dumps({**json.loads(text), "x1": table}, indent=2) + "\n"
        except ValueError:
            raise GraspAtlasError(
                f"the problem file is neither JSON nor a table line by line; add x1 yourself: {json.dumps(table)}"
            ) from None
    without = re.sub(r"(?m)^x1:[ \t]*(null|~)?[ \t]*(#.*)?$\n?", "", text)
    return f"{without.rstrip()}\n\n{_block(x1)}"


def _block(x1: FirstGrasp) -> str:
    """The first grasp in YAML."""
    joints = [f"    {json.dumps(name)}: {_number(value)}" for name, value in x1.joints.items()]
    lines = ["x1:", "  joints:", *joints]
    for name in ("object_xyz", "object_quat_xyzw", "parameters"):
        values = getattr(x1, name)
        if values is not None:
            lines.append(f"  {name}: [{', '.join(map(_number, values))}]")
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    return f"{float(value):.{DIGITS}g}"
