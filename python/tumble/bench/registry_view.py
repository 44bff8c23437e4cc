"""The registry as the screen of the units needs it: units with their due dates, results, certificates."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from tumble.bench.authority import Shared, as_bench, query
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_reading import own_text
from tumble.foundation.project_file import project_settings
from tumble.foundation.provenance import date_now
from tumble.logs.optional import install_command

if TYPE_CHECKING:
    from tumble.calibration.document import Calibration
    from tumble.foundation.results import Row
    from tumble.laboratory.parameter_history import Fleet
    from tumble.laboratory.registry import Registry
    from tumble.tools.compare.result import CompareResult

DueState: TypeAlias = Literal["in use", "due soon", "due", "unknown"]
SOON = timedelta(days=30)
"""Time before the due date from which a unit is due soon."""
DEFAULT_NUMBER = "{year}-{n:04}"
"""Pattern of the numbers of certificates where the project file states none."""
_RANKS: dict[DueState, int] = {"due": 0, "due soon": 1, "unknown": 2, "in use": 3}


@dataclass(frozen=True, slots=True)
class RegisteredUnit:
    """One unit of the registry."""

    unit: str
    """Key in the registry."""
    name: str
    serial: str
    model: str
    lot: str
    due: str
    """Date; empty where none is known."""
    state: DueState

    def matches(self, search: str) -> bool:
        """Returns whether a text stands in its serial, name, model or lot."""
        wanted = search.casefold()
        return any(wanted in text.casefold() for text in (self.serial, self.name, self.model, self.lot))


@dataclass(frozen=True, slots=True)
class ComparedResult:
    """A result of the registry that is held against another."""

    identity: str
    unit: str
    """Serial number, or name without one."""
    date: str

    @property
    def label(self) -> str:
        """Unit and date."""
        return f"{self.unit}, {self.date}"


class RegistryView(Shared):
    """One registry; raises `TumbleError` in one line where it cannot be read."""

    @as_bench
    def __init__(self, address: str) -> None:
        try:
            from tumble.laboratory.registry import Registry
        except ModuleNotFoundError as error:
            raise TumbleError(
                f"the registry needs the Python package {error.name}, which is not installed; type: "
                f"{install_command('laboratory')}"
            ) from error
        self._address = address
        self._registry: Registry = Registry(address)

    def enter(self, calibrations: Sequence[Path]) -> int:
        """Adds calibration files; returns how many are new."""
        from tumble.laboratory.entering import enter_written

        stated = {setting.name: setting.value for setting in project_settings().values()}
        return sum(each.is_new for each in enter_written(self._address, calibrations, stated))

    @query
    def units(self, search: str, state: str) -> list[RegisteredUnit]:
        """Returns the units that match a text and a state, those that are due first."""
        fleets: dict[str, Fleet] = {}
        found = [self._unit(row, fleets) for row in self._registry.units()]
        chosen = [each for each in found if each.matches(search) and state in ("", each.state)]
        return sorted(chosen, key=lambda each: (_RANKS[each.state], each.due, each.serial, each.name))

    @query
    def results(self, unit: RegisteredUnit) -> list[Row]:
        """Returns the results of a unit, the latest first."""
        return list(self._registry.list(serial=unit.serial or unit.name))

    @query
    def certificates(self, unit: RegisteredUnit) -> list[Row]:
        """Returns the certificates of a unit."""
        from tumble.laboratory.certificate.record import listed

        return [
            row for row in listed(self._registry) if (row["serial"], row["name"]) == (unit.serial, unit.name)
        ]

    @query
    def history_page(self, unit: str) -> str:
        """Returns the page of a unit over time."""
        from tumble.laboratory.report.page import HISTORY_REPORT

        row = next((row for row in self._registry.units() if row["unit"] == unit), None)
        if row is None:
            raise TumbleError("no such unit")
        return HISTORY_REPORT.render(self._registry.history(str(row["serial"] or row["name"])))

    @query
    def compared(self, results: Sequence[ComparedResult]) -> CompareResult:
        """Holds the first result against the others; raises `TumbleError` where one cannot be read."""
        from tumble.tools.compare.procedure import compare

        return compare([self._labelled(each) for each in results])

    @query
    def comparison_page(self, first: str, second: str) -> str:
        """Returns the page of two results that were held against each other."""
        found = self.compared([self._result(each) for each in (first, second)])
        with tempfile.TemporaryDirectory() as folder:
            return own_text(found.save(folder)["report"])

    def _result(self, result: str) -> ComparedResult:
        shown = self._registry.show(result)
        unit, row = shown.unit, shown.calibration
        return ComparedResult(result, str(unit["serial"] or unit["name"]), str(row["date"])[:10])

    def _labelled(self, result: ComparedResult) -> Calibration:
        """Returns a calibration with unit and date as its name, which texts and tables then show."""
        return self._registry.calibration(result.identity).model_copy(update={"name": result.label})

    @query
    def certificate(self, number: str) -> bytes:
        """Returns the PDF of a certificate."""
        from tumble.laboratory.certificate.record import documents_of

        return documents_of(self._registry, number).pdf

    def issue(self, result: str, who: str) -> str:
        """Issues the certificate of a result by the settings of the project file; returns its number."""
        try:
            from tumble.laboratory.certificate.collect import certificates_of, results_in_registry
            from tumble.laboratory.certificate.issue import Layout, issue_all
            from tumble.laboratory.certificate.logo import load_logo
            from tumble.laboratory.certificate.numbering import parse_pattern
            from tumble.laboratory.certificate.signing_key import load_key
        except ModuleNotFoundError as error:
            raise TumbleError(
                f"a certificate needs the Python package {error.name}, which is not installed; type: "
                f"{install_command('laboratory')}"
            ) from error
        from tumble.laboratory.registry import UnitFacts

        stated = {setting.name: setting.value for setting in project_settings().values()}
        facts = UnitFacts(manufacturer=stated.get("manufacturer", ""), model=stated.get("model", ""))
        found = list(results_in_registry(self._registry, [result], "", facts, who))
        drafts = certificates_of(found, self._statement(stated), date_now()[:10])
        key, template = stated.get("signing_key"), stated.get("template")
        layout = Layout(
            Path(template) if template else None,
            load_logo(stated.get("logo", "")),
            load_key(Path(key)) if key else None,
        )
        pattern = parse_pattern(stated.get("certificate_number", DEFAULT_NUMBER))
        (issued,) = issue_all(self._registry, drafts, pattern, layout, who or stated.get("authorised_by", ""))
        return issued.number

    def withdraw(self, number: str, why: str, who: str) -> None:
        """Withdraws a certificate; raises `TumbleError` without a reason."""
        from tumble.laboratory.certificate.record import withdraw

        if not why.strip():
            raise TumbleError("no reason is given; type why the certificate is withdrawn")
        withdraw(self._registry, number, why.strip(), who)

    def _statement(self, stated: dict[str, str]) -> Any:  # noqa: ANN401 - imported when it is needed
        from tumble.laboratory.certificate.catalogue import languages_of
        from tumble.laboratory.certificate.collect import Statement

        names = ("address", "country", "accreditation", "customer", "customer_address", "authorised_by")
        return Statement(
            laboratory=stated.get("laboratory", "") or self._registry.laboratory,
            languages=languages_of(stated.get("language", "")),
            remarks=(),
            **{name: stated.get(name, "") for name in names},
        )

    def _unit(self, row: Row, fleets: dict[str, Fleet]) -> RegisteredUnit:
        from tumble.laboratory.history import history_of

        text = {name: str(row[name] or "") for name in ("unit", "name", "serial", "model", "lot")}
        try:
            due = history_of(self._registry, text["serial"] or text["name"], None, fleets).due
        except TumbleError:
            # Several units are called so: none of them has a due date that could be shown beside its name.
            due = ""
        return RegisteredUnit(**text, due=due, state=_state(due))


def _state(due: str) -> DueState:
    if not due:
        return "unknown"
    left = date.fromisoformat(due[:10]) - date.fromisoformat(date_now()[:10])
    if left <= timedelta(0):
        return "due"
    return "due soon" if left <= SOON else "in use"
