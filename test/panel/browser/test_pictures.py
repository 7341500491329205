"""The pictures of docs/howto/panel.md are of the page as it is; `tools/panel_pictures.py` renews them."""

import sys

from system.support import ROOT

sys.path.append(str(ROOT / "tools"))

import panel_pictures


def test_they_can_be_made_again(browser, tmp_path):
    """Another Chromium or other fonts draw other bytes; the size is the same, and none is blank."""
    panel_pictures.make(browser, tmp_path)
    for name in (*panel_pictures.OF_DRIVE, *panel_pictures.OF_BAG):
        made, committed = (folder.joinpath(name).read_bytes() for folder in (tmp_path, panel_pictures.PICTURES))
        assert made[16:24] == committed[16:24]
        assert len(made) > 20_000
