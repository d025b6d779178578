"""The page that a server answers: its actions over HTTP, who is refused, and real clicks in a browser."""

from __future__ import annotations

import base64
import http.client
import json
import re
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from browsing import browser

import graspatlas as ga
from graspatlas.atlas.growth import watched
from graspatlas.quality.evaluation import evaluate
from graspatlas.viewer.live.growth import GrowthPage
from graspatlas.viewer.live.jobs import Job
from graspatlas.viewer.live.page import LivePage
from graspatlas.viewer.live.saving import ARRAYS, WORDS
from graspatlas.viewer.live.serve import watching
from graspatlas.viewer.live.server import TOKEN_HEADER, PageServer
from graspatlas.viewer.live.session import Session

PATIENCE = 60.0
#: True when the page has heard all that there was before.
LIVE = "document.documentElement && document.documentElement.dataset.live === 'yes'"


@dataclass
class Client:
    """Somebody who asks a server."""

    server: PageServer
    session: Session
    headers: dict[str, str] = field(default_factory=dict)

    def request(self, method: str, path: str, body: str | None = None, **headers: str) -> tuple[int, str]:
        place = urlsplit(self.server.address).netloc
        connection = http.client.HTTPConnection(place, timeout=PATIENCE)
        known = {TOKEN_HEADER: self.server.token, **{name.replace("_", "-"): value for name, value in headers.items()}}
        try:
            connection.request(method, path, body, known)
            answer = connection.getresponse()
            return answer.status, answer.read().decode()
        finally:
            connection.close()

    def ask(self, **asked: Any) -> tuple[int, Any]:
        status, text = self.request("POST", "/ask", json.dumps(asked))
        return status, json.loads(text)

    def news(self, since: int = 0) -> Any:
        status, text = self.request("GET", f"/news?since={since}")
        assert status == 200, text
        return json.loads(text)

    def done(self, **asked: Any) -> Any:
        """Ask for work and wait for its end; how it ended."""
        status, told = self.ask(**asked)
        assert status == 202, told
        end = time.monotonic() + PATIENCE
        while (job := self.news()["job"])["running"]:
            assert time.monotonic() < end, job
            time.sleep(0.02)
        assert job["number"] == told["job"]["number"]
        return job


@pytest.fixture(scope="module")
def result(planar_result: ga.Result) -> ga.Result:
    return planar_result


@pytest.fixture(scope="module")
def text(result: ga.Result) -> str:
    """The page, which is the same for all tests, made once."""
    return LivePage(Session(result, Path("result.npz")))._text


@pytest.fixture
def client(result: ga.Result, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Client]:
    monkeypatch.setattr("graspatlas.viewer.live.page.explorer_page", lambda *_: text)
    result.save(tmp_path / "result.npz")
    session = Session(result, tmp_path / "result.npz")
    server = PageServer(LivePage(session), port=0)
    try:
        yield Client(server, session)
    finally:
        server.close()
    assert not server.running


# Actions


def test_another_index_has_the_values_of_the_package(client: Client, result: ga.Result) -> None:
    job = client.done(action="index", index="grasp_isotropy")
    assert not job["error"], job
    assert np.array_equal(client.session.others["grasp_isotropy"], result.values("grasp_isotropy"))
    (news,) = client.news()["news"]
    assert (news["kind"], news["index"]["label"]) == ("index", "grasp isotropy")
    assert client.news(1)["news"] == [], "nothing is told twice"
    assert client.ask(action="index", index="grasp_isotropy")[0] == 400, "it is there already"


def test_climb_ends_where_the_package_does(client: Client, result: ga.Result) -> None:
    n = result.atlas.n_charts
    job = client.done(action="climb", grasp=5)
    end = ga.climb(result, 5)
    x, chart, free = client.session.grasp(n)
    assert np.allclose(x, end.x, atol=1e-9)
    assert (chart, free) == (5, False)
    assert job["show"] == [5, n]
    assert f"{end.quality:.4g}" in job["text"]
    client.done(action="climb", grasp=n, all_motions=True)
    x, chart, free = client.session.grasp(n + 1)
    assert (chart, free) == (5, True)
    assert client.session.added[1].qualities[0] >= end.quality - 1e-9


def test_densify_fills_a_chart_and_its_neighbours_each_time_finer(client: Client, result: ga.Result) -> None:
    job = client.done(action="densify", grasp=7)
    charts = [7, *result.atlas.neighbours[7]]
    samples = ga.densify(result, 0.25 * result.atlas.radius, charts=charts)
    added = np.concatenate([one.grasps.x for one in client.session.added])
    assert sorted(map(tuple, added)) == sorted(map(tuple, samples.x))
    best = client.session.grasp(job["show"][1])[0]
    assert np.array_equal(best, samples.best.x)
    entry = client.news()["news"][0]["grasps"][0]
    assert entry["sample"]
    assert entry["chart"] in charts
    assert len(entry["flat"]) == 2
    before = client.session.count
    client.done(action="densify", grasp=7)
    assert client.session.count - before > 2 * len(samples), "half the spacing"


def test_samples_lie_in_their_unrolled_charts(client: Client, result: ga.Result) -> None:
    client.done(action="densify", grasp=7)
    centers, _ = client.session.layout.unrolled
    for added in client.session.added:
        assert added.flat is not None
        assert np.linalg.norm(added.flat - centers[added.grasps.charts], axis=1).max() < 1.5 * result.atlas.radius


def test_simulation_is_that_of_the_package(client: Client, result: ga.Result) -> None:
    pytest.importorskip("mujoco")
    job = client.done(action="simulate", grasp=3)
    ((number, trial),) = client.session.trials
    alone = ga.simulate(result, charts=[3], progress=False)
    assert number == 3
    assert np.array_equal(trial.survived, alone.survived)
    (news,) = client.news()["news"]
    assert (news["kind"], news["grasp"]) == ("trial", 3)
    assert f"{int(alone.survived.sum())} of {alone.survived.size} pushes" in job["text"]


def test_without_mujoco_the_page_says_how_to_install_it(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise ga.GraspAtlasError("MuJoCo is not installed: pip install 'graspatlas[mujoco]'")

    monkeypatch.setattr("graspatlas.simulation.trials.mujoco_library", missing)
    monkeypatch.setattr("graspatlas.simulation.scene.mujoco_library", missing)
    job = client.done(action="simulate", grasp=3)
    assert job["error"]
    assert "pip install" in job["text"]
    monkeypatch.setattr("graspatlas.viewer.live.page.find_spec", lambda name: None)
    assert LivePage(client.session)._facts()["mujoco"] is False


def test_save_rewrites_the_result_only_on_request(client: Client, result: ga.Result) -> None:
    assert client.session.file is not None
    file, folder = client.session.file, client.session.file.parent
    before = file.read_bytes()
    for asked in ({"action": "climb"}, {"action": "densify"}):
        client.done(grasp=5, **asked)
    client.done(action="index", index="grasp_isotropy")
    assert client.news()["unsaved"] > 2
    assert not client.done(action="save")["error"]
    assert file.read_bytes() == before
    assert client.news()["unsaved"] == 0
    with np.load(folder / ARRAYS) as arrays:
        assert len(arrays["x"]) == client.session.count - client.session.n_first
        assert np.array_equal(arrays["index_grasp_isotropy"], result.values("grasp_isotropy"))
        assert not arrays["sample"][0]
        assert arrays["sample"][1:].all()
    (climb,) = json.loads((folder / WORDS).read_text())["climbs"]
    assert climb["chart"] == 5
    (folder / "summary.json").write_text("{}")
    assert not client.done(action="save", result=True)["error"]
    again = ga.load_result(folder)
    assert json.loads((folder / "summary.json").read_text())["refined"]["quality"] == again.refined_best.quality
    assert again.refined_best.quality == pytest.approx(climb["quality"])
    assert np.array_equal(again.others["grasp_isotropy"], result.values("grasp_isotropy"))
    assert again.check().passed


def test_saved_climbs_join_those_of_a_refinement(result: ga.Result, tmp_path: Path) -> None:
    refined = replace(result, refinement=ga.refine(result))
    session = Session(refined, tmp_path / "result.npz")
    client = Client(PageServer(LivePage(session), port=0), session)
    try:
        best = int(refined.refined_best.chart)
        client.done(action="climb", grasp=best)
        client.done(action="save", result=True)
    finally:
        client.server.close()
    again = ga.load_result(tmp_path).refinement
    assert again is not None
    assert refined.refinement is not None
    assert again.n_peaks == refined.refinement.n_peaks, "it has ended at one that was known"
    assert again.hits.sum() == refined.refinement.hits.sum() + 1


def test_a_page_without_a_server_has_no_buttons(result: ga.Result, text: str, tmp_path: Path) -> None:
    ga.export_html(result, tmp_path / "page.html")
    alone = (tmp_path / "page.html").read_text(encoding="utf-8")
    for word in ("live-climb", "connect-src", TOKEN_HEADER):
        assert word not in alone
        assert word in text


# What is refused


def test_wrong_requests_are_told_in_words(client: Client, result: ga.Result) -> None:
    n = result.atlas.n_charts
    for asked, word in [
        ({"action": "climb", "grasp": n}, f"0 to {n - 1}"),
        ({"action": "climb", "grasp": -1}, "grasp -1"),
        ({"action": "densify", "grasp": "5"}, "'5'"),
        ({"action": "simulate", "grasp": True}, "True"),
        ({"action": "simulate", "grasp": 3, "protocol": "no"}, "protocol"),
        ({"action": "index", "index": "grasp_isotrpy"}, "grasp_isotropy"),
        ({"action": "index"}, "index"),
        ({"action": "delete"}, "climb"),
        ({}, "action"),
    ]:
        status, told = client.ask(**asked)
        assert (status, word in told["error"]) == (400, True), (asked, told)
    for body in ("", "[1]", "{", "[" * 9000, "x" * 20_000):
        assert client.request("POST", "/ask", body)[0] == 400, body[:20]
    assert client.request("GET", "/news?since=-1")[0] == 400
    assert client.request("GET", "/etc/passwd")[0] == 404
    assert client.news()["job"] is None, "nothing has begun"


def test_a_start_that_meets_no_requirement_is_told(result: ga.Result, tmp_path: Path) -> None:
    strict = ga.optimize(result.problem, require=[ga.ForceClosure(friction=0.1, margin=0.9)], atlas=result.atlas)
    session = Session(strict)
    client = Client(PageServer(LivePage(session), port=0), session)
    try:
        status, told = client.ask(action="climb", grasp=5)
        assert (status, "force closure" in told["error"]) == (400, True), told
        client.done(action="densify", grasp=5)
        assert not session.added[0].accepted.any()
        job = client.done(action="climb", grasp=session.n_first)
        assert job["error"]
        assert "requirements" in job["text"]
        assert client.ask(action="save")[0] == 400, "it has no file"
    finally:
        client.server.close()


def test_strangers_are_refused(client: Client) -> None:
    place = urlsplit(client.server.address).netloc
    body = json.dumps({"action": "stop"})
    assert client.request("POST", "/ask", body)[0] == 202
    for headers in (
        {TOKEN_HEADER: "wrong"},
        {TOKEN_HEADER: ""},
        {"Host": "evil.example"},
        {"Host": f"evil.example:{place.split(':')[1]}"},
        {"Host": "192.0.2.7"},
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Origin": f"http://{place.split(':')[0]}:1"},
    ):
        status, text = client.request("POST", "/ask", body, **headers)
        assert status == 403, headers
        assert client.server.token not in text
    assert client.request("GET", "/news", **{TOKEN_HEADER: ""})[0] == 403
    assert client.request("GET", "/", Host="evil.example")[0] == 403, "the token is for this machine"
    assert client.server.token in client.request("GET", "/", **{TOKEN_HEADER: ""})[1]
    assert client.request("POST", "/ask", body, Host=f"localhost:{place.split(':')[1]}")[0] == 202
    assert client.request("POST", "/ask", body, Origin=f"http://{place}")[0] == 202


def test_one_job_at_a_time_until_it_is_stopped(client: Client) -> None:
    def wait(job: Job) -> str:
        job.asked.wait(PATIENCE)
        return "stopped"

    client.session.jobs.start("long work", wait)
    status, told = client.ask(action="climb", grasp=5)
    assert status == 409
    assert "long work" in told["error"]
    assert client.news()["job"]["running"]
    assert client.ask(action="stop")[0] == 202
    client.session.jobs.wait(PATIENCE)
    assert client.news()["job"]["text"] == "stopped"
    assert not client.done(action="climb", grasp=5)["error"]


def test_stopped_work_keeps_what_it_has(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stopped after the first three charts, densify keeps their samples; an index that is half known is not kept."""
    report = Job.report

    def stop_then(job: Job, done: int, total: int | None, text: str = "") -> None:
        report(job, done, total, text)
        if done:
            job.asked.set()

    monkeypatch.setattr(Job, "report", stop_then)
    client.done(action="densify", grasp=7)
    (added,) = client.session.added
    assert len(set(added.grasps.charts.tolist())) == 3
    job = client.done(action="index", index="grasp_isotropy")
    assert "stopped" in job["text"]
    assert not client.session.others


def test_an_error_of_the_program_is_told_and_ends_nothing(
    client: Client, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("oh")

    monkeypatch.setattr("graspatlas.viewer.live.actions.climb", broken)
    job = client.done(action="climb", grasp=5)
    assert job["error"]
    assert "ZeroDivisionError: oh" in job["text"]
    assert "Traceback" in capsys.readouterr().err
    assert not client.done(action="densify", grasp=5)["error"]


# While the atlas grows


def test_growth_tells_only_what_is_new() -> None:
    problem = ga.load_problem("planar_hand")
    page = GrowthPage(problem, "inverse_condition_number")
    system = problem.system(2)
    builder = ga._core.AtlasBuilder(system, problem.start(2), 0.1, 0.5, 1)
    page.watch(system, builder)
    first = page.news(0, 0)
    assert first["n_charts"] == 1
    builder.expand(40, 60.0)
    page._next = 0.0
    page.watch(system, builder)
    n = builder.n_charts
    news = page.news(1, int(first["epoch"]))  # type: ignore[arg-type]
    assert news["epoch"] != first["epoch"]
    assert size(news) == n, "new axes, so all of them"
    builder.expand(n + 10, 60.0)
    page._next = 0.0
    page.watch(system, builder)
    more = page.news(n, int(news["epoch"]))  # type: ignore[arg-type]
    assert more["epoch"] == news["epoch"]
    assert size(more) == builder.n_charts - n
    centers = builder.arrays()["centers"]
    assert np.allclose(page._values, evaluate("inverse_condition_number", ga.Grasps(problem, centers, system)))
    with pytest.raises(ga.GraspAtlasError, match="not done"):
        page.ask({"action": "climb"})


def size(news: Any) -> int:
    """Number of charts that are told."""
    return len(base64.b64decode(news["values"])) // 4


def test_what_cannot_be_shown_does_not_end_the_growth(result: ga.Result, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("oh")

    page = GrowthPage(result.problem, None)
    monkeypatch.setattr(page, "_place", broken)
    with watched(page.watch):
        again = ga.optimize(result.problem)
    assert np.array_equal(again.atlas.centers, result.atlas.centers)
    assert "cannot be shown: oh" in str(page.news(0, 0)["phase"])


def test_an_atlas_is_watched_while_it_grows_and_is_the_same(result: ga.Result) -> None:
    with watching(result.problem, open_browser=False) as watch:
        again = ga.optimize(result.problem)
        page = watch._page
        assert page.news(0, 0)["n_charts"], "it has been looked at"
    assert not watch._server.running
    assert np.array_equal(again.atlas.centers, result.atlas.centers)
    known = page.news(0, 0)["n_charts"]
    ga.optimize(result.problem, max_charts=20)
    assert page.news(0, 0)["n_charts"] == known, "after the block nobody looks"


@contextmanager
def closing_at_end(process: subprocess.Popen[str]) -> Iterator[None]:
    """A block after which a process does not go on, whatever has happened."""
    try:
        yield
    finally:
        process.kill()


@pytest.mark.skipif(sys.platform == "win32", reason="there Ctrl-C is another thing")
def test_optimize_watch_serves_the_result_until_ctrl_c(tmp_path: Path) -> None:
    words = [
        sys.executable,
        "-m",
        "graspatlas",
        "optimize",
        "planar_hand",
        "--watch",
        "--no-browser",
        "--output",
        "out",
    ]
    process = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    with process, closing_at_end(process):
        assert process.stderr is not None
        line = process.stderr.readline()
        found = re.search(r"http://127\.0\.0\.1:\d+/", line)
        assert found, line
        end = time.monotonic() + PATIENCE
        while b'id="live-climb"' not in urllib.request.urlopen(found[0]).read():  # first that of the growth
            assert time.monotonic() < end
            time.sleep(0.1)
        assert (tmp_path / "out" / "result.npz").exists()
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert "planar_hand" in out


# In a browser


@pytest.mark.browser
@pytest.mark.slow
def test_clicks_bring_what_they_say(client: Client, result: ga.Result, tmp_path: Path) -> None:
    n = result.atlas.n_charts
    with browser(tmp_path) as tab:
        tab.open(client.server.address, 1400, 900, ready=LIVE)

        def press(button: str) -> str:
            last = client.session.jobs.last
            before = last.number if last else 0
            tab.click(*tab.middle(f"#{button}"))
            tab.wait_for(f"graspatlas.live.ended > {before}")
            tab.frames()
            return str(tab.run("document.getElementById('live-text').textContent"))

        tab.run("graspatlas.selection.show(5)")
        assert "maximum" in press("live-climb")
        assert tab.run("graspatlas.hand.panes") == [5, n]
        assert tab.run("graspatlas.selection.title(graspatlas.hand.panes[1])[0]") == "End of a climb"
        press("live-densify")
        count = tab.run("graspatlas.selection.count")
        assert count == client.session.count > n + 20
        assert tab.run("graspatlas.atlas.added.shown.length") == count - n
        tab.choose("#mode", "flat")
        tab.frames()
        flat = tab.run(f"[...graspatlas.atlas.centers.slice({3 * (n + 1)})]")
        assert np.isfinite(flat).all()
        tab.choose("#live-index", "grasp isotropy")
        tab.wait_for("graspatlas.facts.indices[graspatlas.selection.index].name === 'grasp_isotropy'")
        values = tab.run("[...graspatlas.selection.values]")
        assert len(values) == count
        assert np.allclose(values[:n], result.values("grasp_isotropy"))
        press("live-save")
        assert (tmp_path / ARRAYS).exists()
        address = tab.run("location.hash")
        tab.open(client.server.address + address, 390, 844, touch=True, ready=LIVE)
        assert tab.run("graspatlas.selection.count") == count, "nothing is lost when the page is loaded again"
        assert f"#chart={','.join(map(str, tab.run('graspatlas.selection.pins')))}" == address
        assert tab.run("document.documentElement.scrollWidth") <= 390
        assert not tab.complaints


@pytest.mark.browser
@pytest.mark.slow
def test_errors_and_trials_stand_in_the_page(client: Client, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    with browser(tmp_path) as tab:
        tab.open(client.server.address, 1400, 900, ready=LIVE)
        tab.run("graspatlas.selection.show(3)")
        tab.click(*tab.middle("#live-simulate"))
        tab.wait_for("document.querySelector('.trial')")
        assert "pushes" in tab.run("document.querySelector('.trial').textContent")
        assert not tab.complaints
        client.server.close()
        tab.click(*tab.middle("#live-climb"))
        tab.wait_for("document.getElementById('live-work').dataset.error === 'yes'")
        assert "does not answer" in tab.run("document.getElementById('live-text').textContent")
