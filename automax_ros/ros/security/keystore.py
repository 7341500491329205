"""A keystore as ROS 2 reads it: an authority, and for each enclave a key, a certificate and signed permissions.

It has the form of `ros2 security create_keystore`: ``public``, ``private`` and ``enclaves``. The one authority, whose
key stays in ``private``, signs identities and permissions. An existing authority is kept, and so are keys of enclaves:
only permissions are written again. So the racks of a plant can be added to one keystore, one after the other. It calls
openssl; keys are of the curve prime256v1 and last ``DAYS`` (decision).
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterable
from datetime import datetime, timedelta, timezone
from pathlib import Path

from automax_ros.core.user_error import UserError
from automax_ros.ros.security.policy import Validity, governance_text, permissions_text
from automax_ros.ros.security.profiles import Enclave

DAYS = 3650
_EC = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-sha256")
_AUTHORITY = "/CN=automax_ros"
_PATIENCE_S = 60.0
_ROLES = ("identity", "permissions")


class KeystoreError(UserError):
    """A keystore cannot be written, or openssl fails."""


class Keystore:
    """A keystore in a folder, created if there is none.

    Raises:
        KeystoreError: it cannot be written, or openssl is not installed.
    """

    def __init__(self, folder: Path, domain: int) -> None:
        self.folder, self._domain = folder, domain
        self._certificate = folder / "public" / "ca.cert.pem"
        self._key = folder / "private" / "ca.key.pem"
        self._enclaves = folder / "enclaves"
        try:
            for part in ("public", "private", "enclaves"):
                (folder / part).mkdir(parents=True, exist_ok=True)
            (folder / "private").chmod(0o700)
            if not self._key.exists():
                _openssl("req", "-x509", *_EC, "-days", DAYS, "-subj", _AUTHORITY, "-keyout", self._key,
                         "-out", self._certificate)  # fmt: skip
            for role in _ROLES:
                _link(self._certificate.with_name(f"{role}_ca.cert.pem"), self._certificate)
                _link(self._key.with_name(f"{role}_ca.key.pem"), self._key)
            self._sign(self._enclaves / "governance", governance_text(domain))
        except OSError as error:
            raise _unwritable(folder, error) from error

    def add(self, enclaves: Iterable[Enclave]) -> None:
        """Write keys, certificates and permissions of enclaves.

        Raises:
            KeystoreError: they cannot be written.
        """
        now = datetime.now(timezone.utc).replace(microsecond=0, tzinfo=None)
        validity = Validity((now - timedelta(days=1)).isoformat(), (now + timedelta(days=DAYS)).isoformat())
        for enclave in enclaves:
            folder = self._enclaves / enclave.path.strip("/")
            try:
                folder.mkdir(parents=True, exist_ok=True)
                for role in _ROLES:
                    _link(folder / f"{role}_ca.cert.pem", self._certificate)
                _link(folder / "governance.p7s", self._enclaves / "governance.p7s")
                self._certify(enclave.path, folder)
                self._sign(folder / "permissions", permissions_text(enclave, self._domain, validity))
            except OSError as error:
                raise _unwritable(folder, error) from error

    def _certify(self, path: str, folder: Path) -> None:
        """Create key and certificate of an enclave, unless they exist."""
        key, certificate, request = folder / "key.pem", folder / "cert.pem", folder / "request.pem"
        if key.exists() and certificate.exists():
            return
        subject = f"/CN={path}".replace("/", r"\/").replace(r"\/", "/", 1)
        _openssl("req", "-new", *_EC, "-subj", subject, "-keyout", key, "-out", request)
        serial = f"0x{os.urandom(8).hex()}"
        _openssl("x509", "-req", "-sha256", "-days", DAYS, "-set_serial", serial, "-in", request,
                 "-CA", self._certificate, "-CAkey", self._key, "-out", certificate)  # fmt: skip
        request.unlink()

    def _sign(self, stem: Path, text: str) -> None:
        plain = stem.with_suffix(".xml")
        plain.write_text(text, encoding="utf-8")
        _openssl("smime", "-sign", "-text", "-in", plain, "-out", stem.with_suffix(".p7s"),
                 "-signer", self._certificate, "-inkey", self._key)  # fmt: skip


def _openssl(*words: object) -> None:
    """Run openssl; only the owner can read the files that it writes.

    Raises:
        KeystoreError: it is not installed, or fails.
    """
    try:
        done = subprocess.run(
            ["openssl", *map(str, words)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_PATIENCE_S,
            umask=0o077,
            check=False,
        )
    except FileNotFoundError as error:
        raise KeystoreError("openssl is not there, which makes keys", "install openssl") from error
    except subprocess.TimeoutExpired as error:
        raise KeystoreError(f"openssl {words[0]} does not end") from error
    if done.returncode:
        raise KeystoreError(f"openssl {words[0]} fails: {done.stderr.strip()[-300:]}")


def _link(place: Path, target: Path) -> None:
    """Link a path to a file of the keystore, relatively, so that the keystore can be moved as a whole."""
    place.unlink(missing_ok=True)
    place.symlink_to(os.path.relpath(target, place.parent))


def _unwritable(path: Path, error: OSError) -> KeystoreError:
    return KeystoreError(f"{path}: the keystore cannot be written: {error.strerror or error}")
