#!/bin/sh
# Installs PostgreSQL, which tests of the registry start for themselves, where it is missing and root runs this. Without it
# these tests fail where CI=true, and are skipped with a message elsewhere.
set -eu

has_postgres() {
    command -v initdb >/dev/null 2>&1 || ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1
}

has_postgres && exit 0

if [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
    echo "installing postgresql"
    export DEBIAN_FRONTEND=noninteractive
    # A cluster that the package made would run all the time; the tests make their own.
    mkdir -p /etc/postgresql-common
    grep -qs '^create_main_cluster' /etc/postgresql-common/createcluster.conf ||
        echo 'create_main_cluster = false' >>/etc/postgresql-common/createcluster.conf
    apt-get update --quiet --quiet
    apt-get install --yes --quiet --quiet --no-install-recommends postgresql >/dev/null
elif [ "${CI:-}" = true ]; then
    echo "make: PostgreSQL is missing; let root run $0" >&2
    exit 1
else
    echo "PostgreSQL is missing: tests of the registry on a server are skipped; root installs it by $0"
fi
