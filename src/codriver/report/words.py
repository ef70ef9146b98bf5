"""The sentences of a report that explain it to a reader who has never seen one."""

from __future__ import annotations

from codriver.estimate import Estimate
from codriver.observers import ESTIMATORS
from codriver.report.numbers import JERKS, expected_lag
from codriver.report.shown import words
from codriver.report.torque_panels import of_our_own


def subject(estimate: Estimate) -> str:
    """What the report is about, for its title."""
    if any(name.startswith("intentional_") for name in estimate):
        return "Driver intention"
    if of_our_own(estimate):
        return "Driver's steering torque"
    if any(name in estimate for name in ("longitudinal_acceleration", "longitudinal_jerk")):
        return "Vehicle acceleration and jerk"
    names = [words(output.name) for output in estimate.estimates]
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]])).capitalize() or estimate.observer


def what(estimate: Estimate) -> str:
    """One sentence: what was estimated from what."""
    estimator = ESTIMATORS.get(estimate.observer)
    if estimator is not None:
        return f"{estimator.meaning[:1].upper()}{estimator.meaning[1:]}."
    inputs = ", ".join(words(name) for name in estimate.grid.values if name in estimate.log)
    return f"Estimated by {estimate.observer} from {inputs}."


def how_to_read(estimate: Estimate) -> list[str]:
    """Paragraphs on the panels that are there."""
    said = []
    if "intentional_jerk" in estimate:
        said.append(
            "Intentional acceleration is what the driver asks for by the pedals; the intentional jerk is how fast "
            "he or she changes that. Near zero the driver keeps to what was decided. A burst is a decision: "
            "negative to slow down, positive to speed up. Bursts of 1 m/s³ and more are clear manoeuvres; a burst "
            "whose band includes zero may be noise."
        )
    if "longitudinal_jerk" in estimate:
        said.append(
            "Acceleration and jerk are the vehicle's own, with the road's slope and the accelerometer's bias "
            "taken out. They hold what the driver did, but also gear shifts, the brake's release at a stop and "
            "bumps: without pedals or torque these cannot be told apart."
        )
    if of_our_own(estimate):
        said.append(
            "The driver's torque is what turns the wheel beside all that is known to act on the column: angle and rate tell how "
            "the wheel moved, inertia and damping what torque that took, and the tyres' or motor's torque less friction is "
            "taken off. A wheel that rests hides up to its friction: the band is wider there."
        )
    if "hands_on" in estimate:
        said.append(
            "The probability that hands are on the wheel weighs how the torque differs from none against how long hands usually "
            "stay on or off. Hands that rest without a torque cannot be told from none; the probability then stays in between."
        )
    lag = expected_lag(estimate)
    if lag is not None and estimate.measured:
        said.append(
            f"The estimate lags: slow changes {'of the jerk ' if _has_jerk(estimate) else ''}show up about {lag:.2f} s late. "
            "That is the price of a smooth estimate"
            + (
                "; a larger ell makes it quicker and noisier, in inverse proportion."
                if "ell" in estimate.provenance
                else "."
            )
        )
    elif lag is not None:
        said.append(
            f"The jerk is the pedals' filtered derivative, about {lag:.2f} s late. There is no band, for there is "
            "no observer to judge its own error; the pedals' noise and all that the road does are in it."
        )
    if any(o.role == "sd" and o.name in estimate for o in estimate.outputs):
        said.append(
            "The band holds the true value 95% of the time if the model and the vehicle's parameters are right. "
            + (
                "It covers the encoder's noise, friction, and the standard deviations in the vehicle file, but no wrong file."
                if of_our_own(estimate)
                else "It covers the sensors' noise, not a wrong mass or a wrong coefficient."
            )
        )
    if "acceleration_offset" in estimate:
        said.append(
            "The road slope is tan(offset / g), the offset being all that the accelerometer shows beyond the "
            "change of speed: 1% is 0.1 m/s². So it contains the accelerometer's bias and any tilt of its "
            "mounting; its changes can be trusted more than its level."
        )
    if estimate.innovations:
        span = "1/ell seconds" if "ell" in estimate.provenance else "half a second"
        said.append(
            "Innovations are what the estimator did not foresee. They should stay between the dotted lines 95% of "
            "the time and lean to neither side; where they do not, something happens that the model does not "
            "know. The verdict's scatter and lean say how large they are one by one and averaged over "
            f"{span}, as multiples of what the band allows: 1 is right, less is cautious, much more is too narrow."
        )
    said.append(
        "Curves are thin and grey, and the plots hatched, where the estimate is not valid. Drag an axis to "
        "move it; click a name in a legend to hide its curve; the boxes above the plots switch the shadings."
    )
    return said


def _has_jerk(estimate: Estimate) -> bool:
    return any(name in estimate for name in JERKS)
