"""A file is there whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from airground.errors import FileError
from airground.records import replacing, write_bytes, write_text

if TYPE_CHECKING:
    from collections.abc import Iterator


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def one_line(error: FileError, path: Path, problem: str) -> None:
    assert str(error) == f"{path}: {problem}"
    assert "\n" not in str(error)
    assert error.exit_code == 2


@pytest.fixture
def umask() -> Iterator[None]:
    before = os.umask(0o027)
    yield
    os.umask(before)


def test_text_keeps_its_line_ends(tmp_path: Path) -> None:
    write_text(tmp_path / "a.json", "ä\nb\n")
    assert (tmp_path / "a.json").read_bytes() == b"\xc3\xa4\nb\n"


def test_replaces_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    write_bytes(os.fspath(path), b"old and longer")
    write_bytes(path, b"new")
    assert path.read_bytes() == b"new"
    assert names(tmp_path) == ["a.bin"]


def test_temporary_lies_beside_with_the_same_suffix(tmp_path: Path) -> None:
    with replacing(tmp_path / "picture.png") as temporary:
        assert temporary.parent == tmp_path.resolve()
        assert temporary.suffix == ".png"
        assert temporary.read_bytes() == b""
        temporary.write_bytes(b"x")
        assert not (tmp_path / "picture.png").exists()
    assert not temporary.exists()
    assert (tmp_path / "picture.png").read_bytes() == b"x"


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit, GeneratorExit])
@pytest.mark.parametrize("existing", [True, False])
def test_nothing_half_written_is_left(
    tmp_path: Path, error: type[BaseException], existing: bool
) -> None:
    path = tmp_path / "a.csv"
    if existing:
        path.write_bytes(b"old")
    with pytest.raises(error), replacing(path) as temporary:  # noqa: PT012
        temporary.write_bytes(b"half")
        raise error
    assert names(tmp_path) == (["a.csv"] if existing else [])
    assert not existing or path.read_bytes() == b"old"


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_interrupted_at_the_last_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os if step == "fsync" else Path, step, interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_text(tmp_path / "a.csv", "x")
    assert names(tmp_path) == []


def test_is_on_the_disk_before_its_name_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced = []
    fsync = os.fsync

    def watch(descriptor: int) -> None:
        synced.append((os.fstat(descriptor).st_ino, (tmp_path / "a").exists()))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", watch)
    write_bytes(tmp_path / "a", b"x")
    assert synced == [((tmp_path / "a").stat().st_ino, False)]


@pytest.mark.skipif(os.name == "nt", reason="permissions of POSIX")
def test_permissions_follow_the_umask(tmp_path: Path, umask: None) -> None:
    write_bytes(tmp_path / "a", b"x")
    assert mode(tmp_path / "a") == 0o640


@pytest.mark.skipif(os.name == "nt", reason="permissions of POSIX")
def test_permissions_of_what_was_there_stay(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"secret")
    path.chmod(0o600)
    write_bytes(path, b"x")
    assert mode(path) == 0o600


@pytest.mark.skipif(os.name == "nt", reason="links need a privilege")
def test_link_stays_a_link(tmp_path: Path) -> None:
    target, link = tmp_path / "target.csv", tmp_path / "link.csv"
    target.write_bytes(b"old")
    link.symlink_to(target)
    write_bytes(link, b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


# Errors


def test_missing_folder(tmp_path: Path) -> None:
    path = tmp_path / "none" / "a.csv"
    with pytest.raises(FileError) as caught:
        write_text(path, "x")
    one_line(caught.value, path, f"the folder {path.parent} does not exist; create it first")


def test_folder_as_target(tmp_path: Path) -> None:
    with pytest.raises(FileError) as caught:
        write_text(tmp_path, "x")
    one_line(caught.value, tmp_path, "is a folder, expected a file")
    assert names(tmp_path) == []


def test_file_as_folder(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b.csv"
    path.parent.write_bytes(b"")
    with pytest.raises(FileError) as caught:
        write_text(path, "x")
    one_line(caught.value, path, f"{path.parent} is not a folder")


def test_closed_folder(own_folder: Path) -> None:
    own_folder.chmod(0o500)
    with pytest.raises(FileError) as caught:
        write_text(own_folder / "a.csv", "x")
    one_line(caught.value, own_folder / "a.csv", "no permission to write it")


def test_write_protected_file_is_respected(own_folder: Path) -> None:
    path = own_folder / "a.csv"
    path.write_bytes(b"old")
    path.chmod(0o400)
    with pytest.raises(FileError) as caught:
        write_text(path, "x")
    one_line(caught.value, path, "no permission to write it")
    assert path.read_bytes() == b"old"
    assert "a.csv" in names(own_folder)
    assert not any(name.startswith(".airground") for name in names(own_folder))


def test_file_of_another_user_is_respected(own_folder: Path) -> None:
    path = own_folder / "theirs.csv"
    if not path.exists():
        pytest.skip("only root can make one")
    with pytest.raises(FileError) as caught:  # although the folder would let us rename onto it
        write_text(path, "x")
    one_line(caught.value, path, "no permission to write it")
    assert path.read_bytes() == b"old"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a named pipe")
def test_special_file_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(FileError, match="is not a plain file"):
        write_text(path, "x")
    assert stat.S_ISFIFO(path.stat().st_mode)


@pytest.mark.skipif(os.name == "nt", reason="links need a privilege")
def test_loop_of_links(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.symlink_to(path)
    with pytest.raises(FileError) as caught:
        write_text(path, "x")
    assert "\n" not in str(caught.value)


def test_full_disk(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with pytest.raises(FileError) as caught, replacing(path):
        raise OSError(errno.ENOSPC, "No space left on device")
    one_line(caught.value, path, "the disk is full")
    assert names(tmp_path) == []


def test_error_about_another_file_passes(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), replacing(tmp_path / "a.csv"):
        (tmp_path / "input.csv").read_bytes()


def test_text_that_utf_8_cannot_hold(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"cannot hold the character '\\ud800'"):
        write_text(tmp_path / "a.txt", "a\ud800")
    assert names(tmp_path) == []


def test_zero_in_the_name(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="cannot write it"):
        write_text(os.fspath(tmp_path / "a\0b"), "x")


def test_longest_name_that_the_system_takes(tmp_path: Path) -> None:
    write_text(tmp_path / ("a" * 251 + ".csv"), "x")
    assert len(names(tmp_path)) == 1
