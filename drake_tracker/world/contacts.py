"""Reads the contacts of a plant."""

from pydrake.multibody.plant import ContactResults
from pydrake.multibody.tree import BodyIndex


def touching_pairs(contacts: ContactResults) -> set[frozenset[BodyIndex]]:
    """Returns the pairs of bodies that touch each other, each a set of two body indices."""
    pairs = set()
    for i in range(contacts.num_point_pair_contacts()):
        info = contacts.point_pair_contact_info(i)
        pairs.add(frozenset((info.bodyA_index(), info.bodyB_index())))
    return pairs
