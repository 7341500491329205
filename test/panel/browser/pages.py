"""What the tests of the page share: the address that a program prints, and how a person uses the page."""

import re
from typing import Any

from system.support import Automax

VIEWS = ("rack", "diagram", "memory", "trends", "drive", "tasks", "log")
PATIENCE_MS = 120_000
"""How long a test waits for what the page shall show; it decides nothing where the program is sound."""


def address_of(process: Automax) -> str:
    """The address of the panel that a program has printed."""
    process.wait_for_line("?token=")
    (address,) = re.findall(r"http://\S+\?token=\S+", "".join(process.out))
    return str(address)


def opened(page: Any, address: str, view: str = "rack") -> Any:
    """Open the page and go to a view; return the page once it has a value of time."""
    page.set_default_timeout(PATIENCE_MS)
    page.goto(address)
    page.locator("#header strong", has_text=re.compile(".")).wait_for()
    show(page, view)
    page.wait_for_selector("body:not(.lost)")
    return page


def show(page: Any, view: str) -> None:
    """Go to a view by its address."""
    page.evaluate("address => { location.hash = address }", view)
    page.wait_for_selector(f".view-{view.partition('?')[0]}")


def confirm(page: Any) -> str:
    """Confirm the operation that the dialog shows, and return its sentence."""
    sentence = page.text_content("dialog .sentence")
    page.click("dialog button:has-text('Confirm')")
    page.wait_for_selector("dialog", state="detached")
    return str(sentence)


def give(page: Any, name: str, value: str, how: str = "Set") -> str:
    """Set or force a variable in the view of memory; return the sentence that was confirmed."""
    show(page, f"memory?q={name.replace('%', '%25')}")
    row = page.locator(".memory-table tr", has=page.locator("th", has_text=re.compile(rf"^▸?{re.escape(name)}$")))
    row.locator("button:has-text('Change')").click()
    control = page.locator("dialog input, dialog select")
    if control.evaluate("node => node.tagName") == "SELECT":
        control.select_option(value)
    else:
        control.fill(value)
    page.click(f"dialog button:has-text('{how}')")
    return confirm(page)


def shows(page: Any, selector: str, text: str) -> None:
    """Wait until an element has a text in it."""
    page.locator(selector, has_text=text).first.wait_for()
