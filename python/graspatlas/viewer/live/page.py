"""The page of a result with its buttons, and what answers it."""

from __future__ import annotations

import json
from importlib import resources
from importlib.util import find_spec

from graspatlas.quality.evaluation import INDICES
from graspatlas.simulation.protocols import PROTOCOLS
from graspatlas.support.validation import PlainTable, StatedTable
from graspatlas.viewer.explorer.page import Additions, explorer_page
from graspatlas.viewer.live.actions import begin
from graspatlas.viewer.live.session import Session

__all__ = ["LivePage"]

#: What stands in the page in place of the token, until it is sent.
NO_TOKEN = "no-token-yet"
#: The scripts of the buttons, after those of the page.
SCRIPTS = ("asked", "added", "live")


class LivePage:
    """The page of a session.

    Args:
        session: The session.
        chart: The chart that it opens at.

    Raises:
        GraspAtlasError: If a mesh cannot be read, or there is no such chart.
    """

    def __init__(self, session: Session, chart: int | None = None) -> None:
        self.session = session
        files = resources.files("graspatlas.viewer.live")
        additions = Additions(
            charts=session.charts,
            layout=session.layout,
            facts=self._facts(),
            controls=(files / "controls.html").read_text(encoding="utf-8"),
            style=(files / "style.css").read_text(encoding="utf-8"),
            scripts="\n".join((files / "scripts" / f"{name}.js").read_text(encoding="utf-8") for name in SCRIPTS),
        )
        self._text = explorer_page(session.result, chart, additions)

    def _facts(self) -> PlainTable:
        return {
            "token": NO_TOKEN,
            "indices": list(INDICES),
            "protocols": list(PROTOCOLS),
            "mujoco": find_spec("mujoco") is not None,
            "file": None if self.session.file is None else self.session.file.name,
        }

    def text(self, token: str) -> str:
        """The page with a token."""
        return self._text.replace(json.dumps(NO_TOKEN), json.dumps(token), 1)

    def news(self, since: int, epoch: int = 0) -> PlainTable:
        """What the page does not know yet."""
        return self.session.state(since)

    def ask(self, asked: StatedTable) -> PlainTable:
        """Begin a piece of work, or stop the one that runs."""
        if asked.get("action") == "stop":
            job = self.session.jobs.stop()
            return {"job": job.table() if job else None}
        return {"job": begin(self.session, asked).table()}
