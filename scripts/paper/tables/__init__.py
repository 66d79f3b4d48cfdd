# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's tables, a module each: its rows of work, and what is made of them.

`table` writes any of them as Markdown and CSV; `beyond` is table 5.
"""
