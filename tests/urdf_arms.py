"""Descriptions of arms as other packages offer them."""

AXES = ("0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1")
LIMIT = '<limit lower="-2.9" upper="2.9" velocity="3" effort="90"/>'


MOTORS = {f"motor{k}": f"joint{k}" for k in range(1, 7)}


def urdf(joints=(), drives=None, axes=AXES, fixed_to_world=False, extra=""):
    """A chain of links of 0.2 m. ``joints`` replaces (type, limit) of the first joints; drives names actuators."""
    inertial = (
        '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    names = ["base", *(f"link{k}" for k in range(1, len(axes))), "flange"]
    parts = [f'<link name="{name}">{inertial}</link>' for name in names]
    if fixed_to_world:
        parts += ['<link name="world"/>']
        parts += ['<joint name="fixed" type="fixed"><parent link="world"/><child link="base"/></joint>']
    for k, axis in enumerate(axes):
        kind, limit = joints[k] if k < len(joints) else ("revolute", LIMIT)
        parts.append(
            f'<joint name="joint{k + 1}" type="{kind}"><parent link="{names[k]}"/><child link="{names[k + 1]}"/>'
            f'<origin xyz="0 0 0.2"/><axis xyz="{axis}"/>{limit}</joint>'
        )
    for actuator, joint in (drives or {}).items():
        parts.append(
            f'<transmission name="{actuator}_t"><type>transmission_interface/SimpleTransmission</type>'
            f'<joint name="{joint}"/><actuator name="{actuator}"/></transmission>'
        )
    return f'<robot name="arm">{"".join(parts)}{extra}</robot>'
