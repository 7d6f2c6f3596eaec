"""The verification book: cases as files, run by pytest, by the page and by the command alike."""
