"""Which meshes a URDF shows, and where they sit on the links that move."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from quadriga.pictures.link_mesh import Rgba
from quadriga.shared.errors import MeshError
from quadriga.shared.robots.conventions import Array

_MOVING: Final = ("revolute", "continuous", "prismatic")  # kinds of joints


@dataclass(frozen=True, slots=True)
class MeshVisual:
    """A mesh file that a link shows.

    Attributes:
        path: the file.
        transform: from the file's coordinates to the link's frame, m, scale included, shape (4, 4).
        rgba: the URDF's colour, 0 … 1; None if it gives none.
        named: whether this colour is that of a material with a name.
    """

    path: Path
    transform: Array
    rgba: Rgba | None
    named: bool


def mesh_visuals(urdf: Path) -> Mapping[str, tuple[MeshVisual, ...]]:
    """Mesh visuals of the links that move or carry one that moves, in the URDF's order.

    What is fixed to such a link, as a foot to a calf or a camera to a trunk, counts as the link's
    own. Boxes, spheres and cylinders are left out: they stand for motors and feet that the meshes
    show too.

    Raises:
        MeshError: the URDF cannot be read, or names a mesh file that is not there.
    """
    try:
        root = ET.parse(urdf).getroot()
    except (OSError, ET.ParseError) as error:
        raise MeshError(f"URDF {urdf}", str(error), "a robot description in XML") from None
    # Elements deeper down, as in a <transmission>, only mention joints.
    joints = root.findall("joint")
    moving = {
        _link(joint, end)
        for joint in joints
        if joint.get("type") in _MOVING
        for end in ("parent", "child")
    }
    fixed = {
        _link(joint, "child"): (_link(joint, "parent"), _origin(joint))
        for joint in joints
        if joint.get("type") == "fixed"
    }
    palette = {str(item.get("name")): _rgba(item) for item in root.iterfind("material")}
    links = {str(link.get("name")): link for link in root.iterfind("link")}
    found: dict[str, list[MeshVisual]] = {name: [] for name in links if name in moving}
    for name, link in links.items():
        carrier, offset = _carrier(name, moving, fixed)
        for visual in link.iterfind("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is not None and carrier in found:
                scale = np.diag([*_numbers(mesh, "scale", "1 1 1"), 1.0])
                transform = offset @ _origin(visual) @ scale
                colour = _colour(visual, palette)
                found[carrier].append(MeshVisual(_mesh_path(urdf, mesh), transform, *colour))
    return {name: tuple(visuals) for name, visuals in found.items() if visuals}


def _carrier(
    link: str, moving: set[str], fixed: Mapping[str, tuple[str, Array]]
) -> tuple[str, Array]:
    """The link of `moving` that `link` is fixed to, and the place on it, shape (4, 4).

    A link above all that moves, such as a frame named `base` over the trunk, is its own carrier.
    """
    offset: Array = np.eye(4)
    for _ in fixed:
        if link in moving or link not in fixed:
            break
        link, place = fixed[link]
        offset = place @ offset
    return link, offset


def _mesh_path(urdf: Path, mesh: ET.Element) -> Path:
    """The file a mesh names: `package://` of a folder above the URDF, or relative to the URDF.

    Raises:
        MeshError: it is not there.
    """
    name = str(mesh.get("filename"))
    if name.startswith("package://"):
        package, _, inside = name.removeprefix("package://").partition("/")
        folders = (above / package for above in urdf.absolute().parents)
        candidates = [folder / inside for folder in folders]
    else:
        candidates = [urdf.parent / name.removeprefix("file://")]
    for path in candidates:
        if path.is_file():
            return path
    raise MeshError(
        f"mesh {name} of {urdf.name}",
        "no such file",
        "a file of the package that the URDF comes from",
        "the package was installed without its meshes",
    )


def _colour(visual: ET.Element, palette: Mapping[str, Rgba | None]) -> tuple[Rgba | None, bool]:
    """The colour of a visual's material and whether that has a name, by which it may be shared."""
    material = visual.find("material")
    if material is None:
        return None, False
    name = material.get("name", "")
    return _rgba(material) or palette.get(name), bool(name)


def _rgba(material: ET.Element) -> Rgba | None:
    color = material.find("color")
    if color is None:
        return None
    red, green, blue, alpha = _numbers(color, "rgba", "")
    return red, green, blue, alpha


def _link(joint: ET.Element, end: str) -> str:
    """The link at one end of a joint, `parent` or `child`."""
    element = joint.find(end)
    if element is None:
        raise MeshError(f"URDF joint {joint.get('name')}", f"no <{end}>", "one link at each end")
    return str(element.get("link"))


def _origin(element: ET.Element) -> Array:
    """An element's place in the frame of what it is part of, shape (4, 4), m."""
    transform: Array = np.eye(4)
    origin = element.find("origin")
    if origin is not None:
        # Roll, pitch and yaw of a URDF turn about axes that stay.
        turn = Rotation.from_euler("xyz", _numbers(origin, "rpy", "0 0 0"))
        transform[:3, :3] = turn.as_matrix()
        transform[:3, 3] = _numbers(origin, "xyz", "0 0 0")
    return transform


def _numbers(element: ET.Element, attribute: str, default: str) -> tuple[float, ...]:
    text = element.get(attribute, default)
    expected = 4 if attribute == "rgba" else 3
    try:
        numbers = tuple(float(word) for word in text.split())
    except ValueError:
        numbers = ()
    if len(numbers) != expected:
        raise MeshError(f"URDF <{element.tag} {attribute}>", repr(text), f"{expected} numbers")
    return numbers
