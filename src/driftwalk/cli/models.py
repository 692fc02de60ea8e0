"""`driftwalk models`: the family of self-propelled motion models."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from driftwalk.cli.options.shared_types import Json, argument
from driftwalk.cli.terminal.output import print_json, print_next, print_table

if TYPE_CHECKING:
    from driftwalk.motion import Member, MotionModel, Part, ParticleModel


def models(
    name: Annotated[
        str | None, argument("[NAME]", "A model with its parts, such as run_rest+wall.")
    ] = None,
    json: Json = False,
) -> None:
    """List the motion models of bodies that move by themselves.

    Without a name, lists all models and the parts that you can add. With a name, prints the
    equation, source and parameters of that model. For a model of your own, such as mine.py:tumbler,
    prints only the parameters.
    """
    from driftwalk.motion import MEMBERS, PARTS, motion_model

    if name is not None:
        _show(motion_model(name), json=json)
    elif json:
        print_json(
            {
                "models": [_described(one) for one in MEMBERS.values()],
                "parts": [_described(one) for one in PARTS.values()],
            }
        )
    else:
        for title, some in (("models", MEMBERS), ("parts", PARTS)):
            rows = [(one.name, len(one.parameters), one.sentence) for one in some.values()]
            print_table(rows, columns=("name", "parameters", "what"), title=title)
        print_next("compare-models", "RECORDING", "--models", "all", "-o", "models")


def _show(model: MotionModel, *, json: bool) -> None:
    from driftwalk.motion import ParticleModel

    if json:
        member = _of_the_family(model) if isinstance(model, ParticleModel) else {}
        parameters = [one.describe() for one in model.parameters]
        print_json({**member, "name": model.name, "parameters": parameters})
        return
    if isinstance(model, ParticleModel):
        print_table(_rows(model), title=model.name)
    rows = [
        (one.name, one.unit, f"{one.low:g}", f"{one.high:g}", one.scale, one.meaning)
        for one in model.parameters
    ]
    print_table(
        rows, columns=("parameter", "unit", "from", "to", "scale", "what"), title="parameters"
    )


def _of_the_family(model: ParticleModel) -> dict[str, Any]:
    return {**_described(model.member), "parts": [_described(one) for one in model.parts]}


def _rows(model: ParticleModel) -> list[tuple[str, str]]:
    rows = [
        ("what", model.member.sentence),
        ("equation", model.member.formula),
        ("source", model.member.source),
    ]
    for part in model.parts:
        rows.append((f"+{part.name}", " ".join(filter(None, (part.sentence, part.formula)))))
    return rows


def _described(one: Member | Part) -> dict[str, Any]:
    found: dict[str, Any] = {
        "name": one.name,
        "sentence": one.sentence,
        "formula": one.formula,
        "parameters": [parameter.describe() for parameter in one.parameters],
    }
    source = getattr(one, "source", None)
    return found if source is None else {**found, "source": source}
