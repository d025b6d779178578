"""Planes behind which no finger can be: which regions they hide, and which symmetries they leave."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from proposals.conftest import HAND, LINKS

import graspatlas as ga
from graspatlas.collision.checker import collision_checker
from graspatlas.problems import load_obstacles
from graspatlas.proposals.assignments.matching import _palms
from graspatlas.proposals.assignments.planes import Planes
from graspatlas.proposals.assignments.symmetry import region_symmetries

BOX = (0.05, 0.05, 0.1)


def floor(z: float, normal: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> ga.Obstacle:
    return ga.Obstacle.plane("floor", (0.2, 0.3, z), normal)


@pytest.mark.parametrize(("z", "hidden"), [(-0.06, 0), (-0.05, 1), (0.0, 1), (0.05, 5), (0.06, 6)])
def test_a_floor_hides_the_faces_that_it_leaves_no_room_below(z: float, hidden: int) -> None:
    regions = ga.find_regions(trimesh.creation.box(BOX))
    assert sum(Planes.of([floor(z)]).hides(region) for region in regions) == hidden


def test_it_draws_no_points_that_a_wall_leaves_no_room_for() -> None:
    planes = Planes.of([floor(0.01), ga.Obstacle.plane("wall", (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0))])
    points = np.array([[-0.02, 0.0, 0.02], [0.02, 0.0, 0.02], [-0.02, 0.0, 0.0], [-0.02, 0.0, 0.0105]])
    down = np.tile([0.0, 0.0, -1.0], (4, 1))
    assert planes.touchable(points, -down).tolist() == [True, False, False, True]
    assert planes.touchable(points, down).tolist() == [True, False, False, False]


def test_obstacles_of_the_palm_and_bodies_are_no_planes_of_the_object() -> None:
    palm = ga.Obstacle.plane("flange", (0.0, 0.0, 0.0), frame="palm")
    planes = Planes.of([palm, ga.Obstacle.box("shelf", (1.0, 1.0, 1.0))])
    assert not planes.behind(np.zeros((3, 3)) - 1.0).any()


@pytest.mark.parametrize(("normal", "count"), [((0, 0, 1), 4), ((1, 0, 0), 2), ((1, 1, 0), 2), ((1, 1, 1), 1)])
def test_only_turns_that_keep_the_plane_are_symmetries(normal: tuple[float, float, float], count: int) -> None:
    regions = ga.find_regions(trimesh.creation.box(BOX))
    assert len(region_symmetries(regions)) == 8
    assert len(region_symmetries(regions, Planes.of([floor(-0.05, normal)]).kept_by)) == count


def test_the_palm_is_where_its_pads_say() -> None:
    rng = np.random.default_rng(3)
    R = np.array([trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3] for _ in range(20)])
    palms, pads = rng.normal(size=(20, 3)), rng.normal(size=(20, 3, 3))
    points = np.einsum("nab,nmb->nma", R, pads) + palms[:, None]
    np.testing.assert_allclose(_palms(pads, points), palms, atol=1e-12)


def test_a_can_on_a_table_is_taken_from_above_the_table(can_file: Path, tmp_path: Path, proposed: ga.Proposals) -> None:
    found = ga.propose(HAND, can_file, tmp_path, links=LINKS, top=1, on_table=True, max_seconds=None)
    counts = found.counts
    assert (counts.all, counts.hidden, counts.symmetric) == (27, 19, 0), "all with the bottom; none is upside down"
    (best,) = found.proposals
    problem, again = best.result.problem, ga.load_problem(best.folder / "problem.yaml")
    assert again.obstacles == problem.obstacles
    (table,) = problem.obstacles
    np.testing.assert_allclose(table.pose.xyz, (0.0, 0.0, -0.05), atol=1e-7)
    grasp = best.result.refined_best if best.result.refinement else best.result.best
    checker = collision_checker(problem)
    with_table = [i for i, pair in enumerate(checker.pairs) if "obstacle/table" in pair]
    assert len(with_table) > 10
    assert checker.clearances(grasp.x[None], with_table).min() >= 0.0
    assert proposed.proposals[0].quality > best.quality, "the table leaves less"


def test_obstacles_are_read_from_any_file_that_states_them(tmp_path: Path) -> None:
    table, rail = "{name: table, plane: {}, xyz: [0, 0, -0.05]}", "{name: rail, box: {size: [1, 1, 1]}}"
    (tmp_path / "world.yaml").write_text(f"name: some problem\nobstacles:\n  - {table}\n  - {rail}\n")
    assert load_obstacles(tmp_path / "world.yaml") == (
        ga.Obstacle.plane("table", (0.0, 0.0, -0.05)),
        ga.Obstacle.box("rail", (1.0, 1.0, 1.0)),
    )
