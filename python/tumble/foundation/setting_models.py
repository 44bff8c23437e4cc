"""Settings of the procedures, made from the core's tables; `setting_models.pyi` shows their fields."""

from tumble.foundation.setting_table import model_of

MonitorSettings = model_of("redundancy", "MonitorSettings", "All settings of the monitor.")
SpinSettings = model_of("spin", "SpinSettings", "Course of a spin, and limits of the result.")
