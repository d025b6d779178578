"""The client of a scheduler: what it says where something is missing, and that it leaves nothing behind."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import dask.distributed as dask
import pytest

from graspatlas.cluster.client import connected, need
from graspatlas.cluster.local_cluster import local_cluster, safe_path
from graspatlas.errors import GraspAtlasError

# Dask's own start and end on a busy machine.
pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture
def address() -> Iterator[str]:
    """A scheduler without workers."""
    with dask.LocalCluster(n_workers=0, processes=False, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster.scheduler_address


def test_a_scheduler_without_workers_is_warned_of(address: str) -> None:
    with (
        pytest.warns(RuntimeWarning, match=f"has no workers yet; start some with: dask worker {address}"),
        connected(address, 1) as client,
    ):
        assert client.scheduler.address == address
    assert client.status == "closed"


def test_no_scheduler_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("graspatlas.cluster.client.ANSWER_SECONDS", 0.5)
    with (
        pytest.raises(GraspAtlasError, match=r"answers at 'tcp://127\.0\.0\.1:1' .*start one with: dask scheduler"),
        connected("tcp://127.0.0.1:1", 1),
    ):
        pass
    with pytest.raises(GraspAtlasError, match="no Dask scheduler answers at 'nowhere'"), connected("nowhere", 1):
        pass


def test_what_is_not_installed_is_named() -> None:
    need("a search on workers", "dask.distributed")
    with pytest.raises(
        GraspAtlasError, match=r"a search on workers needs no_such_dask: pip install 'graspatlas\[sweep"
    ):
        need("a search on workers", "dask.distributed", "no_such_dask")


def test_the_safe_path_is_set_for_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    for before in (None, ""):
        monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
        if before is not None:
            monkeypatch.setenv("PYTHONSAFEPATH", before)
        with safe_path():
            assert os.environ["PYTHONSAFEPATH"] == "1"
        assert os.environ.get("PYTHONSAFEPATH") == before


def where_and_what() -> tuple[str, str]:
    import random

    return os.getcwd(), str(random.__file__)


@pytest.mark.slow
def test_local_workers_work_here_and_are_not_led_astray(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file in the current folder that is named as a module of the standard library is none for them."""
    (tmp_path / "random.py").write_text("raise ImportError('not this one')\n")
    monkeypatch.chdir(tmp_path)
    with connected(None, 1) as client:
        folder, module = client.submit(where_and_what).result()
        (process,) = client.run(os.getpid).values()
    assert Path(folder) == tmp_path
    assert Path(module).parent != tmp_path
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


def test_a_cluster_beside_another_program_s_dashboard_starts_in_silence(recwarn: pytest.WarningsRecorder) -> None:
    with socket.socket() as other:
        try:
            other.bind(("0.0.0.0", 8787))  # where Dask serves unless told
        except OSError:
            pass  # somebody does already
        else:
            other.listen()
        cluster = local_cluster(1)
    with cluster:
        assert cluster.scheduler.http_server.address == "127.0.0.1"
    assert not [warning for warning in recwarn if "8787" in str(warning.message)]
