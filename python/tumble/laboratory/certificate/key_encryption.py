"""Work that one guess at the password of an encrypted key takes, which the file states.

The library derives a key from a password for as long as the file states, and heeds no signal meanwhile.
"""

from __future__ import annotations

from collections.abc import Iterator

from asn1crypto import algos, core, keys, pem

MOST_ITERATIONS = 10_000_000
"""Iterations of PBKDF2 or PKCS #12: some seconds, and more than ten times what OWASP recommends."""
MOST_SCRYPTED = 1 << 28
"""Bytes that scrypt may write: 128 times cost, size of blocks and parallel parts."""
LARGEST_WORK = "10 million iterations, or 256 MiB of scrypt"
_SCRYPT = "1.3.6.1.4.1.11591.4.11"
_ENCRYPTED = "ENCRYPTED PRIVATE KEY"


def is_affordable(content: bytes) -> bool:
    """Returns whether all encrypted keys of a PEM file (RFC 5958) can be tried in seconds.

    Raises `ValueError` where one is damaged, or its encryption is unknown.
    """
    try:
        return all(map(_may_be_tried, _encrypted_keys(content)))
    except Exception as error:  # of a damaged key any part of the library may stumble
        raise ValueError("a damaged key") from error


def _encrypted_keys(content: bytes) -> Iterator[keys.EncryptedPrivateKeyInfo]:
    number = content.count(f"BEGIN {_ENCRYPTED}".encode())
    if number == 0:
        return
    found = [each for kind, _, each in pem.unarmor(content, multiple=True) if kind == _ENCRYPTED]
    if len(found) != number:  # which another reader might find
        raise ValueError("keys that are no PEM")
    yield from map(keys.EncryptedPrivateKeyInfo.load, found)


def _may_be_tried(key: keys.EncryptedPrivateKeyInfo) -> bool:
    encryption: algos.EncryptionAlgorithm = key["encryption_algorithm"]
    if encryption["algorithm"].native != "pbes2":
        return int(encryption["parameters"]["iterations"].native) <= MOST_ITERATIONS
    derivation = encryption["parameters"]["key_derivation_func"]
    name, stated = derivation["algorithm"].native, derivation["parameters"]
    if name == "pbkdf2":
        return int(stated["iteration_count"].native) <= MOST_ITERATIONS
    if name == _SCRYPT:
        _, cost, size, parallel, *_ = core.Sequence.load(stated.dump()).native.values()
        return 128 * int(cost) * int(size) * int(parallel) <= MOST_SCRYPTED
    raise ValueError(f"an encryption by {name}")
