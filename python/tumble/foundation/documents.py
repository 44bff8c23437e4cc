"""YAML files that people read and edit: one clear line for a mistake in them, floats exact both ways."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias, TypeGuard, TypeVar, cast

import numpy as np
import yaml
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    TypeAdapter,
    ValidationError,
    model_serializer,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from tumble.foundation.bounded_yaml import parse, problem_in_words, state_numbers
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.field_docstrings import field_docstrings
from tumble.foundation.file_reading import read_text_whole
from tumble.foundation.file_status import path_of
from tumble.foundation.files import FileKind, write_text
from tumble.foundation.log_formats import has_log_ending
from tumble.foundation.names import normal_name
from tumble.foundation.recording import FloatArray
from tumble.foundation.schemas import DocumentSchema, schema_stated
from tumble.foundation.words import in_utf8, short

try:
    from yaml import CSafeDumper as SafeDumper
except ImportError:  # PyYAML without libyaml writes the same, and takes four times as long
    from yaml import SafeDumper  # type: ignore[assignment]

Model = TypeVar("Model", bound=BaseModel)
Plain = TypeVar("Plain")

LARGEST_DOCUMENT = 4 << 20
"""Bytes; the calibration of a unit with hundreds of rests takes a hundredth of it."""
LARGEST_NUMBER = 1e30
"""Largest number; beyond it fourth powers overflow, and no measurement is that large."""


class Document(BaseModel):
    """A part of a file: every key is known, and nothing is converted behind the user's back."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        arbitrary_types_allowed=True,
        allow_inf_nan=False,
        defer_build=True,
        validate_by_name=True,
        validate_by_alias=True,
    )
    renamed_keys: ClassVar[Mapping[str, str]] = {}
    """Current names of keys of earlier versions."""

    def content(self) -> dict[str, Any]:
        """Plain mappings, lists, numbers and text as they stand in the file; absent parts are left out."""
        return self.model_dump(mode="json", by_alias=True)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Describes each key by the docstring of its field; only schemas need it, which all would await."""
        found = handler(schema)
        properties = handler.resolve_ref_schema(found).get("properties", {})
        meanings = cls._meanings()
        for name, field in cls.model_fields.items():
            if field.description is None and name in meanings:
                properties[field.alias or name]["description"] = meanings[name]
        return found

    @classmethod
    def _meanings(cls) -> dict[str, str]:
        """Returns the docstrings of fields; one that is declared again without a docstring has none."""
        meanings: dict[str, str] = {}
        for kind in reversed(cls.__mro__):
            if issubclass(kind, Document):
                own = field_docstrings(kind)
                declared = vars(kind).get("__annotations__", {})
                meanings = {name: text for name, text in meanings.items() if name not in declared} | dict(own)
        return meanings

    @model_serializer(mode="wrap")
    def _leave_out_absent(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        fields = type(self).model_fields.items()
        absent = {
            key
            for name, field in fields
            if not field.is_required() and getattr(self, name) is None
            for key in (name, field.alias)
        }
        return {key: value for key, value in handler(self).items() if key not in absent}


@dataclass(frozen=True, slots=True)
class ArrayField:
    """Marks a model field as a read-only float array of that shape, a nested list in the file.

    With `gaps`, a number that the data could not show is NaN in memory and `null` in the file.
    """

    shape: tuple[int, ...]
    gaps: bool = False

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self._read, serialization=core_schema.plain_serializer_function_ser_schema(_plain_numbers)
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        items: JsonSchemaValue = {"type": ["number", "null"] if self.gaps else "number"}
        for length in reversed(self.shape):
            items = {"type": "array", "items": items, "minItems": length, "maxItems": length}
        return items

    def _read(self, value: object) -> FloatArray:
        wanted = f"needs {'x'.join(map(str, self.shape))} numbers"
        if self.gaps:
            wanted += " or null"
        numbers = value.tolist() if isinstance(value, np.ndarray) else value
        if not _has_shape(numbers, self.shape):
            raise ValueError(f"{wanted}, found {short(numbers)}")
        strays = [number for number in _flatten(numbers) if not self._is_number(number)]
        if strays:
            raise ValueError(f"{wanted}{_bounds(strays[0])}, found {short(strays[0])}")
        array = np.array(numbers, dtype=np.float64)
        array.flags.writeable = False
        return array

    def _is_number(self, value: object) -> bool:
        if value is None:
            return self.gaps
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        return abs(value) <= LARGEST_NUMBER or (self.gaps and math.isnan(value))


Name: TypeAlias = Annotated[str, AfterValidator(normal_name)]
"""Name of a unit or a person, or a serial number, in its one form."""
Vector: TypeAlias = Annotated[FloatArray, ArrayField((3,))]
Matrix: TypeAlias = Annotated[FloatArray, ArrayField((3, 3))]
VectorWithGaps: TypeAlias = Annotated[FloatArray, ArrayField((3,), gaps=True)]


def read_document(
    path: Path | str, model: type[Model], schema: DocumentSchema, *, text: str | None = None
) -> Model:
    """Reads a YAML file into the model of a schema, in bounded time and memory whatever the file holds.

    With `text`, its content as `document_content` returned it, no file is read.

    Raises `CalibrationFileError`: one line naming the file, the line, the key and the remedy.
    """
    path = path_of(path, f"a {schema.what}", CalibrationFileError)
    remedy = f"see tumble schema {schema.name}"
    try:
        node, data = _read_mapping(path, schema.what, remedy, text)
    except CalibrationFileError as error:
        if has_log_ending(path) and not isinstance(error.__cause__, OSError):
            raise CalibrationFileError(f"{path}: is a log, not a {schema.what}; give another file") from error
        raise
    stated = schema_stated(data.get("schema"))
    if stated is not None and stated is not schema:
        raise CalibrationFileError(f"{path}: is a {stated.what}, not a {schema.what}; give another file")
    if schema.is_stated and "schema" not in data:
        raise CalibrationFileError(f"{path}: says no schema, so it may be no {schema.what}; {remedy}")
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise CalibrationFileError(f"{path}: {_problem(error, node, model)}; {remedy}") from error


def document_content(path: Path | str, what: str) -> str:
    """Returns the text of a document; raises `CalibrationFileError` where it cannot be read."""
    return read_text_whole(path, LARGEST_DOCUMENT, what, remedy="check the path", error=CalibrationFileError)


def _read_mapping(
    path: Path, what: str, remedy: str, text: str | None
) -> tuple[yaml.Node | None, Mapping[Any, Any]]:
    try:
        node, data = parse(document_content(path, what) if text is None else text)
    except yaml.YAMLError as error:
        raise CalibrationFileError(f"{path}: {problem_in_words(error)}; correct the YAML there") from error
    if not isinstance(data, Mapping):
        found = "an empty file" if data is None else short(data)
        raise CalibrationFileError(f"{path}: not a {what}: {found} where keys are needed; {remedy}")
    return node, data


def document_kind(schema: str) -> FileKind:
    """Returns the kind of the documents with `schema: NAME/VERSION`, of whatever version."""
    name, _, _ = schema.partition("/")
    line = rf"^schema:\s*[\"']?{re.escape(name)}/"
    return FileKind(f"a document of schema {name}", re.compile(line.encode(), re.MULTILINE))


def write_document(
    path: Path | str, header: str, content: Mapping[str, Any], *, renews: bool = False
) -> None:
    """Writes a document; `content` begins with its `schema`, `renews` is as in `files.replacing`."""
    write_text(path, document_text(header, content), document_kind(content["schema"]), renews=renews)


def document_text(header: str, content: Mapping[str, Any]) -> str:
    """Prints YAML with rows of numbers on one line each, under a comment; floats read back bit by bit."""
    comment = "".join(f"# {line}\n" for line in header.splitlines())
    return comment + yaml.dump(content, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=10**6)


def read_value(text: str) -> Any:  # noqa: ANN401 - a model checks the type
    """Reads one value as it would stand in a file; raises `yaml.YAMLError` where it is no YAML."""
    return parse(text)[1]


def well_typed(value: Plain) -> Plain:
    """Returns a dataclass made of plain data with fields of their types; raises `ValueError` for others."""
    return made_of(type(value), asdict(cast("Any", value)))


def made_of(kind: type[Plain], content: Mapping[str, Any]) -> Plain:
    """Returns a dataclass of plain data; raises `ValueError` where a field is missing or of another type."""
    return cast("Plain", _adapter(cast("Any", kind)).validate_python(content))


@cache
def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def mistake_in(error: ValidationError, model: type[BaseModel]) -> str:
    """Describes the first error in words: its key, the error, and the closest known key."""
    first = _first(error)
    key = ".".join(_part(part) for part in first["loc"])
    return (f"{key} " if key else "") + _in_words(first, model)


def _is_row(value: object) -> TypeGuard[Sequence[object]]:
    # To ask an abstract class takes ten times as long, and most are numbers.
    if isinstance(value, float | str):
        return False
    return isinstance(value, (list, Sequence))


def _has_shape(value: object, shape: tuple[int, ...]) -> bool:
    if not shape:
        return not _is_row(value)
    if not _is_row(value) or len(value) != shape[0]:
        return False
    return all(_has_shape(item, shape[1:]) for item in value)


def _flatten(value: object) -> list[object]:
    return [number for item in value for number in _flatten(item)] if _is_row(value) else [value]


def _bounds(stray: object) -> str:
    """Describes the allowed range of a number that is outside it."""
    is_too_large = isinstance(stray, int | float) and abs(stray) > LARGEST_NUMBER
    return f" no larger than {LARGEST_NUMBER:g}" if is_too_large else ""


def _plain_numbers(array: FloatArray) -> list[object]:
    numbers = array.astype(object)
    numbers[np.isnan(array)] = None
    plain_numbers: list[object] = numbers.tolist()
    return plain_numbers


class _Dumper(SafeDumper):
    """Rows of numbers and small records on one line, no anchors."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def _represent_list(dumper: _Dumper, data: list[Any]) -> yaml.Node:
    row = not any(isinstance(item, list | dict) for item in data)
    node = dumper.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=row)
    for item in node.value:
        if isinstance(item, yaml.MappingNode):
            item.flow_style = True
    return node


def _represent_mapping(dumper: _Dumper, data: dict[Any, Any]) -> yaml.Node:
    row = bool(data) and all(item is None or isinstance(item, float) for item in data.values())
    return dumper.represent_mapping("tag:yaml.org,2002:map", data, flow_style=row)


def _represent_text(dumper: _Dumper, data: str) -> yaml.Node:
    """Escapes text that is not UTF-8, as in names of files of other encodings: it could not be read again."""
    text = in_utf8(data)
    return dumper.represent_scalar("tag:yaml.org,2002:str", text)


# Text such as 12e5, which PyYAML takes for text, is quoted: a serial number reads back as it is.
state_numbers(_Dumper)
_Dumper.add_representer(str, _represent_text)
_Dumper.add_representer(list, _represent_list)
_Dumper.add_representer(dict, _represent_mapping)


def _problem(error: ValidationError, node: yaml.Node | None, model: type[BaseModel]) -> str:
    """First mistake in words, with its line and key path, and how many more there are."""
    location = _first(error)["loc"]
    more = error.error_count() - 1
    rest = f" (and {more} more)" if more else ""
    return f"line {_line(node, location)}: {mistake_in(error, model)}{rest}"


def _first(error: ValidationError) -> dict[str, Any]:
    details = error.errors(include_url=False)
    # A misspelt key shows up twice, as unknown and as missing; the unknown one is clearer.
    return dict(next((detail for detail in details if detail["type"] == "extra_forbidden"), details[0]))


def _part(part: object) -> str:
    """Shows a key, at most so much of it as a key of ours has."""
    return str(part)[:_LONGEST_KEY]


_LONGEST_KEY = 60


@cache
def _known_keys(model: type[BaseModel]) -> tuple[str, ...]:
    """Keys of a kind of document and of its parts, sorted."""
    schema = model.model_json_schema()
    parts = [schema, *schema.get("$defs", {}).values()]
    return tuple(sorted({key for part in parts for key in part.get("properties", {})}))


def _in_words(detail: dict[str, Any], model: type[BaseModel]) -> str:
    match detail["type"]:
        case "missing":
            return "is missing"
        case "extra_forbidden":
            key = _part(detail["loc"][-1])
            if issubclass(model, Document) and key in model.renamed_keys:
                return f"is called {model.renamed_keys[key]} now"
            near = difflib.get_close_matches(key, _known_keys(model), n=1)
            return "is not a known key" + (f", did you mean {near[0]!r}?" if near else "")
        case "value_error":
            return str(detail["ctx"]["error"])
        case "literal_error":
            return f"needs to be {detail['ctx']['expected']}, found {short(detail['input'])}"
        case _:
            wish = str(detail["msg"]).replace("Input should be", "needs to be")
            return f"{wish}, found {short(detail['input'])}"


def _line(node: yaml.Node | None, location: Sequence[int | str]) -> int:
    """Line of the deepest part of `location` that stands in the file."""
    if node is None:
        return 1
    line: int = node.start_mark.line + 1
    for part in location:
        child: yaml.Node | None = None
        if isinstance(node, yaml.MappingNode):
            for key_node, value_node in node.value:
                if key_node.value == part:
                    child, line = value_node, key_node.start_mark.line + 1
        elif isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
            child = node.value[part]
            line = child.start_mark.line + 1
        if child is None:
            break
        node = child
    return line
