"""Charts that figures share: they take values and texts, and know nothing of studies.

A figure is a `sheet.Sheet` of panels in the style of `house`. Six kinds of charts are drawn into its panels: dots with
intervals (`rows`), curves with bands (`lines`), maps of cells (`cells`), paths (`arena`), networks and other pictures
(`shapes`), and scatters with the line of equality (`scatter`). `marks` has the values that a page shows on hover.
"""
