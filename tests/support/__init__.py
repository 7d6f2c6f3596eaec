"""Scenes, fakes and processes that tests share."""
