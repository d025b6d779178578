# /// script
# requires-python = ">=3.10"
# dependencies = ["graspatlas"]
#
# [tool.uv.sources]
# graspatlas = { path = ".." }
# ///
"""Cover a sphere with charts, then an ellipsoid that is written in Python.

Run it with ``python examples/sphere.py``; it needs nothing but graspatlas.
"""

import numpy as np

import graspatlas as ga


class Ellipsoid(ga.System):
    """An ellipsoid with semi-axes 1, 2 and 3: one equation in three variables."""

    def __init__(self) -> None:
        super().__init__(n_variables=3, n_equations=1)
        self.squares = np.array([1.0, 4.0, 9.0])

    def residual(self, x: np.ndarray) -> np.ndarray:
        """R(x) [1]."""
        return np.array([np.sum(x * x / self.squares) - 1.0])

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Derivative of R [1, 3]."""
        return (2.0 * x / self.squares)[None]


def main() -> None:
    """Trace both surfaces and compare their areas with the known ones."""
    sphere = ga.build_atlas(ga.systems.Sphere(3), [1.0, 0.0, 0.0], radius=0.1, epsilon=0.1)
    print(f"sphere: {sphere.n_charts} charts in {1000 * sphere.seconds:.1f} ms, {sphere.status}")
    print(f"  area {sphere.volumes.sum():.4f}, 4 pi is {4 * np.pi:.4f}")
    print(f"  Euler characteristic {sphere.euler_characteristic()}")

    system = Ellipsoid()
    x0 = np.array([1.0, 0.0, 0.0])
    print(f"ellipsoid: its Jacobian agrees with finite differences to {ga.systems.jacobian_error(system, x0):.1e}")
    ellipsoid = ga.build_atlas(system, x0, radius=0.2, epsilon=0.1)
    print(f"  {ellipsoid.n_charts} charts in {ellipsoid.seconds:.2f} s, {ellipsoid.status}")
    print(
        f"  area {ellipsoid.volumes.sum():.2f}, exactly 48.88; Euler characteristic {ellipsoid.euler_characteristic()}"
    )

    # Any function can be read on the charts, and is then known everywhere: here the highest point.
    highest = ellipsoid.centers[np.argmax(ellipsoid.centers[:, 2])]
    print(f"  highest chart centre {np.round(highest, 3)}, largest residual {ellipsoid.residuals.max():.1e}")


if __name__ == "__main__":
    main()
