"""The panel: a rack or a recording in the browser, as one page that the program itself serves."""
