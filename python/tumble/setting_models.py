"""Settings of the procedures, made from the core's tables; `setting_models.pyi` shows their fields."""

from tumble.setting_table import model_of

SpinSettings = model_of("spin", "SpinSettings", "How to spin and how to judge it.")
