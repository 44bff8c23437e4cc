"""The job file of a fleet: which procedure, over which inputs, with results where."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, get_args

from pydantic import Field, field_validator, model_validator

from tumble.foundation.documents import Document, read_document
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.procedures import PROCEDURES
from tumble.foundation.schemas import FLEET_JOB

SCHEMA: Final = "tumble-fleet-job/1"
INPUT = "{input}"
"""FileStore of an input in the arguments of a procedure."""
TASK_SECONDS = 2.0
"""s of work of one task, beside which the cost of handing it over is small."""
Reduction: TypeAlias = Literal["drift", "due", "outliers", "lots"]
REDUCTIONS: tuple[Reduction, ...] = get_args(Reduction)
OptionValue: TypeAlias = str | int | float | bool | list[str] | list[float]

_ROWS = {procedure.word: procedure for procedure in PROCEDURES}
_FUNCTION = re.compile(r"(?P<module>[\w.]+):(?P<name>\w+)")


class Simulated(Document):
    """Simulated recordings in place of inputs, one for each seed."""

    scenario: str
    """Word of `tumble simulate`: `spin`, `flight`."""
    count: int = Field(gt=0)
    """Number of recordings."""
    seed: int = Field(0, ge=0)
    """Seed of the first; each has the next one."""
    options: dict[str, OptionValue] = Field(default_factory=dict)
    """Options of `tumble simulate`."""


class SeedRange(Document):
    """Seeds that follow one another."""

    first: int = Field(0, ge=0)
    count: int = Field(gt=0)


class FleetJob(Document):
    """A job: one procedure over many inputs."""

    schema_: Literal["tumble-fleet-job/1"] = Field(SCHEMA, alias="schema")
    procedure: str
    """Name of a procedure, or `MODULE:FUNCTION` that makes a mapping of a seed."""
    arguments: str = ""
    """Arguments of its command, `{input}` for the input; `{input}` alone where nothing is stated."""
    options: dict[str, OptionValue] = Field(default_factory=dict)
    """Options of its command, without `--`."""
    inputs: str | list[str] = ""
    """Paths and URLs with `*`, or with `{unit}`, `{lot}` and other names; or a manifest, `.parquet`."""
    simulate: Simulated | None = None
    seeds: SeedRange | list[int] | None = None
    """Seeds that a function gets, one each."""
    results: str
    """Folder or URL of the results."""
    registry: str = ""
    """Registry that gets the results."""
    reduce: list[Reduction] = Field(default_factory=lambda: [*REDUCTIONS])
    """Summaries over all units that `run` prints."""
    task_seconds: float = Field(TASK_SECONDS, gt=0.0, le=600.0)

    @model_validator(mode="after")
    def _one_kind_of_input(self) -> FleetJob:
        stated = [bool(self.inputs), self.simulate is not None, self.seeds is not None]
        if sum(stated) != 1:
            raise ValueError("needs one of inputs, simulate and seeds")
        if self.is_function:
            if self.seeds is None:
                raise ValueError("a function needs seeds, such as {count: 2000}")
            return self
        if self.procedure not in _ROWS:
            known = ", ".join(_ROWS)
            raise ValueError(
                f"procedure {self.procedure!r} is unknown; give one of {known}, or MODULE:FUNCTION"
            )
        if self.seeds is not None:
            raise ValueError("seeds are for a function; give inputs or simulate")
        if not self.arguments and self.simulate is None and len(_ROWS[self.procedure].typed.split()) > 1:
            example = _ROWS[self.procedure].typed.format(INPUT)
            raise ValueError(f"{self.procedure} takes several logs; give arguments, such as {example!r}")
        return self

    @field_validator("arguments")
    @classmethod
    def _has_words(cls, text: str) -> str:
        shlex.split(text)  # raises for a quotation mark without its other one
        return text

    @property
    def is_function(self) -> bool:
        """Returns whether the job calls a function instead of a procedure."""
        return _FUNCTION.fullmatch(self.procedure) is not None

    @property
    def patterns(self) -> list[str]:
        """Paths and URLs of the inputs."""
        return [self.inputs] if isinstance(self.inputs, str) else self.inputs

    @property
    def all_seeds(self) -> Sequence[int]:
        """Returns the seeds of the function, or of what is simulated."""
        if isinstance(self.seeds, list):
            return self.seeds
        if self.simulate is not None:
            return range(self.simulate.seed, self.simulate.seed + self.simulate.count)
        return range(self.seeds.first, self.seeds.first + self.seeds.count) if self.seeds else ()

    @property
    def work(self) -> str:
        """Text that is the same for jobs that compute the same of an input."""
        simulated = self.simulate and {"scenario": self.simulate.scenario, **self.simulate.options}
        return json.dumps([self.procedure, self.arguments, self.options, simulated], sort_keys=True)

    def words(self, place: str) -> list[str]:
        """Returns the command line of one input, without `tumble`."""
        typed = self.arguments or (_ROWS[self.procedure].typed.format(INPUT) if self.simulate else INPUT)
        # A place that begins like an option is none.
        place = f"./{place}" if place.startswith("-") else place
        return [
            self.procedure,
            *(word.replace(INPUT, place) for word in shlex.split(typed)),
            *option_words(self.options),
        ]


def load_job(path: Path | str) -> FleetJob:
    """Reads a job; raises `CalibrationFileError` in one line: file, line, key and remedy."""
    job = read_document(path, FleetJob, FLEET_JOB)
    if not job.results.strip():
        raise CalibrationFileError(f"{path}: results is empty; give a folder or a URL")
    return job


def option_words(options: Mapping[str, Any]) -> list[str]:
    """Returns options as typed: `{"still": "5s", "level-floor": true}` is `--still=5s --level-floor`.

    A value is one word with its option, so that none begins another option.
    """
    return list(_typed(options))


def _typed(options: Mapping[str, Any]) -> Iterator[str]:
    for name, value in options.items():
        for each in value if isinstance(value, list) else [value]:
            if each is False:
                continue
            text = repr(each).removesuffix(".0") if isinstance(each, float) else str(each)
            yield f"--{name}" if each is True else f"--{name}={text}"
