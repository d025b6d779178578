"""Grasps of any hand and any mesh: which fingers touch which regions, and the best grasp of each such assignment."""

from graspatlas.proposals.outcome import Proposal, Proposals
from graspatlas.proposals.propose import propose

__all__ = ["Proposal", "Proposals", "propose"]
