"""Options of `tumble certificate`; those of one concern are a class."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from tumble.cli.options import Options
from tumble.cli.registry_option import laboratory as laboratory_room
from tumble.foundation.errors import CommandError

if TYPE_CHECKING:
    from tumble.laboratory.certificate.collect import Statement
    from tumble.laboratory.certificate.issue import Layout
    from tumble.laboratory.certificate.numbering import Pattern
    from tumble.laboratory.certificate.signing_key import SigningKey


def text_option(name: str, words: str, metavar: str = "TEXT") -> Any:  # noqa: ANN401 - an option of typer
    """Return an option that takes text."""
    return typer.Option(name, metavar=metavar, help=words, show_default=False)


KeyOption: TypeAlias = Annotated[
    str,
    text_option("--signing-key", "Key of the laboratory (tumble certificate key); signs both files.", "FILE"),
]
WhyOption: TypeAlias = Annotated[str, text_option("--why", "Reason, for the record.")]
NumberArgument: TypeAlias = Annotated[
    str, typer.Argument(metavar="NUMBER", help="Number of a certificate in the registry.")
]
AsFoundOption: TypeAlias = Annotated[
    list[str] | None,
    text_option(
        "--as-found", "Result of the unit as it was found; the others are as left. Repeatable.", "RESULT"
    ),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class NumberOptions(Options):
    """Number of a certificate, and the one that it replaces."""

    number: Annotated[
        str, text_option("--number", "Number of the certificate, where no registry counts.")
    ] = ""
    certificate_number: Annotated[
        str, text_option("--certificate-number", "Pattern of numbers, such as IMU-{year}-{n:04}.", "PATTERN")
    ] = ""
    supersedes: Annotated[
        str, text_option("--supersedes", "Number of the certificate that this one replaces.", "NUMBER")
    ] = ""

    def check(self, *, has_registry: bool) -> None:
        """Raise `CommandError` unless either the registry counts or a number is given."""
        if has_registry and self.number:
            raise CommandError("--number is given, and the registry counts; leave it out")
        if not has_registry and not self.number:
            raise CommandError(
                "no registry is set, so that nothing counts certificates; give --registry FILE, or "
                "--number TEXT"
            )

    def check_units(self, units: int) -> None:
        """Raise `CommandError` where one number is given for several units."""
        if units > 1 and (self.number or self.supersedes):
            raise CommandError(
                f"{units} units are given, and --number and --supersedes are of one certificate; "
                "give one unit"
            )

    def pattern(self) -> Pattern:
        """Return the pattern of numbers; raises `TumbleError`."""
        from tumble.laboratory.certificate.numbering import USUAL, parse_pattern

        return parse_pattern(self.certificate_number or USUAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class StatementOptions(Options):
    """Statements of the laboratory."""

    laboratory: Annotated[str, text_option("--laboratory", "Name of the laboratory.")] = ""
    address: Annotated[str, text_option("--address", "Its address.")] = ""
    country: Annotated[str, text_option("--country", "Its country by ISO 3166-1, such as DE.", "CODE")] = ""
    accreditation: Annotated[str, text_option("--accreditation", "Number of its accreditation.")] = ""
    customer: Annotated[
        str, text_option("--customer", "Name of the customer; the owner of the unit if not given.")
    ] = ""
    customer_address: Annotated[str, text_option("--customer-address", "Address of the customer.")] = ""
    authorised_by: Annotated[
        str, text_option("--authorised-by", "Person who authorises the certificate.")
    ] = ""
    language: Annotated[
        str, text_option("--language", "Languages: en, or en,zh for English and Chinese.", "en|en,zh")
    ] = ""
    remark: Annotated[
        list[str] | None,
        text_option("--remark", "Deviation from the method, or another remark. Repeatable."),
    ] = None

    def stated(self, registered: str) -> Statement:
        """Return them as a certificate takes them; `registered` is the laboratory that the registry names."""
        from tumble.laboratory.certificate.catalogue import languages_of
        from tumble.laboratory.certificate.collect import Statement

        return Statement(
            laboratory=self.laboratory or registered,
            address=self.address,
            country=self.country,
            accreditation=self.accreditation,
            customer=self.customer,
            customer_address=self.customer_address,
            authorised_by=self.authorised_by,
            languages=languages_of(self.language),
            remarks=tuple(self.remark or ()),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class AppearanceOptions(Options):
    """Layout of certificates, and the key that signs them."""

    template: Annotated[
        str,
        text_option(
            "--template", "Layout, in typst; tumble certificate template prints the usual one.", "FILE"
        ),
    ] = ""
    logo: Annotated[str, text_option("--logo", "Logo of the laboratory: SVG, PNG or JPEG.", "FILE")] = ""
    signing_key: KeyOption = ""

    def layout(self) -> Layout:
        """Read what they name; raises `TumbleError`."""
        from tumble.laboratory.certificate.issue import Layout
        from tumble.laboratory.certificate.logo import load_logo

        template = Path(self.template) if self.template else None
        return Layout(template, load_logo(self.logo), key_of(self.signing_key))


def key_of(path: str) -> SigningKey | None:
    """Read a key, where one is named; raises `TumbleError`."""
    if not path:
        return None
    key: SigningKey = laboratory_room("certificate.signing_key").load_key(Path(path))
    return key
