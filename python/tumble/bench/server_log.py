"""Logs of the libraries that serve pages: no address in them shows its token."""

from __future__ import annotations

import logging

from tumble.foundation.secrets import without_secrets

LOGGERS = ("nicegui", "uvicorn", "uvicorn.error", "uvicorn.access")
"""Loggers of the libraries; a page that is not found is logged with its whole address."""


class SecretsFilter(logging.Filter):
    """Hides the secrets in a message."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Writes the message anew."""
        record.msg, record.args = without_secrets(record.getMessage(), is_message=True), ()
        return True


def hide_secrets_in_logs() -> None:
    """Has all messages of the libraries written without secrets, from now on."""
    for name in LOGGERS:
        logger = logging.getLogger(name)
        if not any(isinstance(each, SecretsFilter) for each in logger.filters):
            logger.addFilter(SecretsFilter())
