"""Genomes and networks as JSON with a version, and back, bit for bit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Generic, Literal, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from realitygap._limits import MOST_JSON_BYTES, parse_json, read_file
from realitygap.errors import RecordError, RecordVersionError
from realitygap.kernels.neat.genome import NeatRules

from ._interface import ControllerInterface
from ._settings import ACTIVATIONS, NeatSettings

FORMAT_VERSION = 1
"""Version of the format of networks, and of genomes without names of inputs and outputs."""
NAMED_VERSION = 2
"""Version of the format of genomes with names of inputs and outputs."""
Kind = Literal["genome", "network"]


class _Form(BaseModel):
    """The fields that genomes and networks share: those that set how a node answers."""

    model_config = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False)

    activation: Literal["tanh", "sigmoid", "identity"]
    activation_slope: float = Field(gt=0, le=100)
    recurrent: bool
    bias_value: float

    def rules(self, n_inputs: int, n_outputs: int, *, constant: bool, node_bias: bool) -> NeatRules:
        """Return the rules that decoding and activating need; all others are the defaults'."""
        settings = NeatSettings(
            activation=self.activation,
            activation_slope=self.activation_slope,
            recurrent=self.recurrent,
            node_bias=node_bias,
            bias_value=self.bias_value,
        )
        return settings.rules(n_inputs, n_outputs, bias_input=n_inputs - 1 if constant else -1)


class NodeForm(BaseModel):
    """A node gene as written."""

    model_config = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False)

    id: int = Field(ge=0, lt=2**31)
    kind: Literal["input", "bias", "output", "hidden"]
    bias: float


class ConnectionForm(BaseModel):
    """A connection gene as written."""

    model_config = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False)

    innovation: int = Field(ge=0, lt=2**31)
    source: int
    target: int
    weight: float
    enabled: bool


class InterfaceForm(BaseModel):
    """Names of inputs and outputs as written."""

    model_config = ConfigDict(extra="ignore", strict=True)

    inputs: list[str] = Field(max_length=1024)
    outputs: list[str] = Field(max_length=1024)


class GenomeForm(_Form):
    """A genome as written; exports of earlier versions have its names apart."""

    node_bias: bool
    interface: InterfaceForm | None = None
    input_names: list[str] | None = None
    output_names: list[str] | None = None
    nodes: list[NodeForm]
    connections: list[ConnectionForm]


class ActiveNodeForm(BaseModel):
    """A node of a network as written: its number, bias, and the edges into it."""

    model_config = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False)

    node: int = Field(ge=0, lt=2**31)
    bias: float
    sources: list[int]
    weights: list[float]


class NetworkForm(_Form):
    """A network as written."""

    n_inputs: int = Field(ge=1)
    n_outputs: int = Field(ge=1)
    constant: bool
    nodes: list[ActiveNodeForm]


F = TypeVar("F", GenomeForm, NetworkForm)


def head(kind: Kind, rules: NeatRules, bias_value: float) -> dict[str, Any]:
    """Return the fields that every document begins with."""
    names = {code: name for name, code in ACTIVATIONS.items()}
    return {
        "format": f"realitygap {kind}",
        "version": FORMAT_VERSION,
        "activation": names[rules.activation],
        "activation_slope": float(rules.activation_slope),
        "recurrent": bool(rules.recurrent),
        "bias_value": float(bias_value),
    }


def interface_to_dict(interface: ControllerInterface) -> dict[str, Any]:
    """Return the names of a genome's inputs and outputs as they are written."""
    names = {"inputs": list(interface.inputs), "outputs": list(interface.outputs)}
    return {"version": NAMED_VERSION, "interface": names}


def interface_of(form: GenomeForm) -> ControllerInterface | None:
    """Return the names of inputs and outputs in a document; None if it has none.

    Raises:
        ControllerError: They are no names of a controller's inputs and outputs.
    """
    if form.interface is not None:
        return ControllerInterface(tuple(form.interface.inputs), tuple(form.interface.outputs))
    if form.input_names is not None and form.output_names is not None:
        return ControllerInterface(tuple(form.input_names), tuple(form.output_names))
    return None


def to_text(values: dict[str, Any]) -> str:
    """Return a document as text, with numbers that are restored bit for bit."""
    return json.dumps(values, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def from_text(text: str | bytes, kind: Kind, where: str) -> Any:
    """Return the document in a text; `where` is its name in messages.

    Raises:
        RecordError: it is no JSON, or cut off.
    """
    try:
        return parse_json(text)
    except ValueError as error:
        raise RecordError(f"{where} is no JSON, or cut off ({error}), expected a {kind}.") from error


def from_file(path: Path, kind: Kind) -> Any:
    """Return the document in a file.

    Raises:
        RecordError: it cannot be read, is no JSON, or cut off.
    """
    try:
        text = read_file(path, MOST_JSON_BYTES)
    except OSError as error:
        raise RecordError(f"Could not read {path}: {error.strerror or error}. Check the path.") from error
    return from_text(text, kind, str(path))


def checked(values: Any, form: type[F], kind: Kind, where: str) -> F:
    """Return the values of a document, after its format, version and types were checked.

    Raises:
        RecordError: they are not those of this kind.
        RecordVersionError: of another version.
    """
    expected = f"realitygap {kind}"
    written = values.get("format") if isinstance(values, Mapping) else None
    if written != expected:
        raise RecordError(f"{where} has the format {written!r}, expected {expected!r}.")
    known = (FORMAT_VERSION, NAMED_VERSION) if kind == "genome" else (FORMAT_VERSION,)
    if values.get("version") not in known:
        raise RecordVersionError(
            f"{where} is a {kind} of version {values.get('version')}, this realitygap reads version "
            f"{' and '.join(map(str, known))}. Use the realitygap that wrote it."
        )
    try:
        return form.model_validate(dict(values))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise RecordError(f"{where} is not a whole {kind}: {place}: {first['msg']}.") from error


class Written(Generic[F]):
    """A genome or a network: written as JSON with a version, and read again."""

    _kind: ClassVar[Kind]
    _form: type[F]

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        raise NotImplementedError

    @classmethod
    def _from(cls, form: F, where: str) -> Self:
        raise NotImplementedError

    @classmethod
    def _read(cls, values: Any, where: str) -> Self:
        return cls._from(checked(values, cls._form, cls._kind, where), where)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Create it from the values of `to_dict`. NEAT's rates, which these values lack, have their defaults.

        Raises:
            RecordError: The values are of something else.
            RecordVersionError: Another version wrote them.
        """
        return cls._read(values, "The mapping")

    def to_json(self) -> str:
        """Return it as JSON with a version; numbers are restored bit for bit."""
        return to_text(self.to_dict())

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Create it from the text of `to_json`.

        Raises:
            RecordError: The text is no JSON, or of something else.
            RecordVersionError: Another version wrote it.
        """
        return cls._read(from_text(text, cls._kind, "The text"), "The text")
