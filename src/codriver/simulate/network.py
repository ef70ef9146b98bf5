"""The simulated car's CAN: which messages it sends, and how they map to standard names.

Names, units and byte orders are of the kind found in series cars: several suppliers, each with habits of its own;
none of the names is a standard one, which is what a names file is for.
"""

from __future__ import annotations

from codriver.simulate.can_layout import Field, Message

_RPM, _DEG, _KMH = 9.549296585513721, 57.29577951308232, 3.6


def _counter(start: int, name: str, *, motorola: bool = False) -> Field:
    return Field(name, "", start, 4, motorola=motorola, comment="counts frames modulo 16")


MESSAGES: tuple[Message, ...] = (
    Message("EngineData", 0x0C8, 100, 8, (
        Field("ENG_TorqueActual", "engine_torque", 7, 12, 0.5, -500, "Nm", motorola=True, comment="given"),
        Field("ENG_TorqueDriver", "engine_torque_request", 11, 12, 0.5, -500, "Nm", motorola=True, comment="asked"),
        Field("ENG_Speed", "engine_speed", 31, 16, 0.25, 0, "rpm", _RPM, motorola=True),
        _counter(59, "ENG_Counter", motorola=True),
    ), "ECM"),
    Message("PedalData", 0x0D2, 50, 4, (
        Field("APP_Position", "accelerator_pedal", 0, 8, 0.4, 0, "%", 100.0),
        _counter(24, "APP_Counter"),
    ), "ECM"),
    Message("Brakes", 0x0E1, 50, 6, (
        Field("BRK_MasterCylinder", "brake_pressure", 4, 12, 0.1, 0, "bar", 1e-5, signed=True),
        Field("BRK_PedalSwitch", "brake_switch", 0, 1),
        _counter(40, "BRK_Counter"),
    ), "ESC"),
    Message("Gearbox", 0x1A0, 50, 5, (
        Field("TCU_GearEngaged", "gear", 3, 4, motorola=True, comment="1 to 5"),
        Field("TCU_ClutchOpen", "clutch", 15, 8, 0.5, 0, "%", 100.0, motorola=True, comment="torque held back"),
        Field("TCU_ShiftActive", "shift", 16, 1, motorola=True),
        _counter(35, "TCU_Counter", motorola=True),
    ), "TCU"),
    Message("Dynamics", 0x1B4, 100, 8, (
        Field("ESC_AccelX", "longitudinal_acceleration", 0, 12, 0.01, 0, "m/s2", signed=True),
        Field("ESC_AccelY", "lateral_acceleration", 12, 12, 0.01, 0, "m/s2", signed=True),
        Field("ESC_YawRate", "yaw_rate", 24, 14, 0.02, 0, "deg/s", _DEG, signed=True),
        _counter(56, "ESC_Counter"),
    ), "ESC"),
    Message("Wheels", 0x1C6, 50, 8, (
        Field("WHL_SpeedFL", "wheel.front_left", 7, 14, 0.036, 0, "km/h", _KMH, motorola=True),
        Field("WHL_SpeedFR", "wheel.front_right", 9, 14, 0.036, 0, "km/h", _KMH, motorola=True),
        Field("WHL_SpeedRL", "wheel.rear_left", 27, 14, 0.036, 0, "km/h", _KMH, motorola=True),
        Field("WHL_SpeedRR", "wheel.rear_right", 45, 14, 0.036, 0, "km/h", _KMH, motorola=True),
        _counter(59, "WHL_Counter", motorola=True),
    ), "ESC"),
    Message("Steering", 0x0A5, 50, 4, (
        Field("EPS_WheelAngle", "steering_wheel_angle", 0, 14, 0.1, 0, "deg", _DEG, signed=True),
        _counter(24, "EPS_Counter"),
    ), "EPS"),
    Message("Cluster", 0x3F0, 10, 2, (
        Field("IPC_DisplaySpeed", "dashboard_speed", 0, 9, 0.5, 0, "km/h", _KMH, comment="as shown: it flatters"),
    ), "IPC"),
)  # fmt: skip

# Standard name: the channels it is made from. Rear wheels only: they are not steered, so their mean is the car's own
# speed.
STANDARD: dict[str, tuple[str, ...]] = {
    "longitudinal_speed": ("Wheels.WHL_SpeedRL", "Wheels.WHL_SpeedRR"),
    "longitudinal_acceleration": ("Dynamics.ESC_AccelX",),
    "accelerator_pedal": ("PedalData.APP_Position",),
    "brake_pressure": ("Brakes.BRK_MasterCylinder",),
    "brake_switch": ("Brakes.BRK_PedalSwitch",),
    "engine_torque": ("EngineData.ENG_TorqueActual",),
    "engine_torque_request": ("EngineData.ENG_TorqueDriver",),
    "engine_speed": ("EngineData.ENG_Speed",),
    "gear": ("Gearbox.TCU_GearEngaged",),
    "clutch": ("Gearbox.TCU_ClutchOpen",),
    "steering_wheel_angle": ("Steering.EPS_WheelAngle",),
    "yaw_rate": ("Dynamics.ESC_YawRate",),
    "lateral_acceleration": ("Dynamics.ESC_AccelY",),
}


def names_text() -> str:
    """The names file of the simulated car."""
    units = {f"{message.name}.{field.name}": field.unit for message in MESSAGES for field in message.fields}
    lines = ["# How the simulated car's CAN signals map to standard names (see docs/names.md)."]
    for name, sources in STANDARD.items():
        listed = ", ".join(f'"{source}"' for source in sources)
        lines += ["", f"[{name}]", f"source = {listed if len(sources) == 1 else f'[{listed}]'}"]
        if units[sources[0]]:
            lines.append(f'unit = "{units[sources[0]]}"')
    return "\n".join(lines) + "\n"
