"""Keystores: what openssl itself says of them, and what a second writing keeps."""

from __future__ import annotations

import shutil
import stat
import subprocess

import pytest

from automax_ros.ros.security.keystore import Keystore, KeystoreError
from automax_ros.ros.security.policy import written_topics
from automax_ros.ros.security.profiles import Enclave, Profile

RACK = Enclave("/plant/pm1/rack", (Profile("/plant/pm1", "rack", publish=("/plant/pm1/variables",)),))
OTHER = Enclave("/plant/pm2/rack", (Profile("/plant/pm2", "rack", publish=("/plant/pm2/variables",)),))

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")


def openssl(*words: object) -> str:
    done = subprocess.run(["openssl", *map(str, words)], capture_output=True, text=True, check=True)
    return done.stdout


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "keystore"
    Keystore(made, 5).add([RACK])
    return made


def verified(folder, name: str) -> str:
    return openssl("smime", "-verify", "-text", "-in", folder / name, "-CAfile", folder / "permissions_ca.cert.pem")


def test_an_enclave_has_all_that_ros_reads_signed_by_the_authority(folder):
    enclave = folder / "enclaves" / "plant" / "pm1" / "rack"
    assert openssl("verify", "-CAfile", enclave / "identity_ca.cert.pem", enclave / "cert.pem").strip().endswith("OK")
    assert "CN = /plant/pm1/rack" in openssl("x509", "-noout", "-subject", "-in", enclave / "cert.pem")
    public = openssl("x509", "-noout", "-pubkey", "-in", enclave / "cert.pem")
    assert openssl("pkey", "-in", enclave / "key.pem", "-pubout") == public
    permissions = verified(enclave, "permissions.p7s")
    assert all(f"<topic>{name}</topic>" in permissions for name in written_topics(RACK))
    assert "<id>5</id>" in permissions
    assert "<default>DENY</default>" in permissions
    assert "<enable_join_access_control>true" in verified(enclave, "governance.p7s")


def test_a_signed_text_that_was_changed_is_refused(folder):
    enclave = folder / "enclaves" / "plant" / "pm1" / "rack"
    signed = enclave / "permissions.p7s"
    signed.write_text(signed.read_text().replace("pm1/variables", "pm2/variables"))
    with pytest.raises(subprocess.CalledProcessError):
        verified(enclave, "permissions.p7s")


def test_private_keys_are_their_owners_alone(folder):
    for path in (folder / "private" / "ca.key.pem", folder / "enclaves" / "plant" / "pm1" / "rack" / "key.pem"):
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE((folder / "private").stat().st_mode) == 0o700


def test_racks_share_an_authority_and_keys_are_kept(folder):
    enclave = folder / "enclaves" / "plant" / "pm1" / "rack"
    kept = {path: path.read_bytes() for path in (folder / "public" / "ca.cert.pem", enclave / "key.pem")}
    Keystore(folder, 5).add([RACK, OTHER])
    assert {path: path.read_bytes() for path in kept} == kept
    other = folder / "enclaves" / "plant" / "pm2" / "rack"
    assert openssl("verify", "-CAfile", folder / "public" / "ca.cert.pem", other / "cert.pem").strip().endswith("OK")
    verified(enclave, "permissions.p7s")


def test_a_folder_that_cannot_be_one_is_told(tmp_path):
    (tmp_path / "keystore").write_text("")
    with pytest.raises(KeystoreError, match="cannot be written"):
        Keystore(tmp_path / "keystore", 0)


def test_without_openssl_it_says_so(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(KeystoreError, match="openssl is not there"):
        Keystore(tmp_path / "keystore", 0)
