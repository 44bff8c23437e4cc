"""Words of certificates in their languages. A text of a certificate is one text for each language."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from tumble.foundation.errors import TumbleError
from tumble.laboratory.certificate.model import Language

Texts: TypeAlias = dict[str, str]
"""One text for each language, by its code."""

LABELS: Mapping[str, tuple[str, str]] = {
    "title": ("Calibration certificate", "校准证书"),
    "number": ("Number", "证书编号"),
    "page": ("Page", "页"),
    "of": ("of", "共"),
    "laboratory": ("Laboratory", "校准实验室"),
    "accreditation": ("Accreditation", "认可编号"),
    "customer": ("Customer", "委托方"),
    "item": ("Item", "被校器具"),
    "inertial unit": ("Inertial measurement unit", "惯性测量单元"),
    "manufacturer": ("Manufacturer", "制造厂"),
    "model": ("Model", "型号"),
    "serial": ("Serial number", "出厂编号"),
    "name": ("Name", "名称"),
    "address": ("Address", "地址"),
    "issued": ("Date of issue", "签发日期"),
    "calibrated": ("Date of calibration", "校准日期"),
    "condition": ("Condition", "状态"),
    "begun": ("Calibration begun", "校准开始日期"),
    "place": ("Place", "校准地点"),
    "method": ("Method", "校准方法"),
    "software": ("Software", "软件"),
    "environment": ("Environment", "环境条件"),
    "temperature": ("Temperature of the sensor", "传感器温度"),
    "gravity": ("Gravity", "重力加速度"),
    "traceability": ("Traceability", "计量溯源性"),
    "reference": ("Reference", "参考标准"),
    "due": ("Reference valid until", "参考标准有效期至"),
    "results": ("Results", "校准结果"),
    "parameter": ("Parameter", "参数"),
    "value": ("Value", "值"),
    "expanded uncertainty": ("Expanded uncertainty U", "扩展不确定度 U"),
    "uncertainty": ("U", "U"),
    "coverage factor": ("k", "k"),
    "unit": ("Unit", "单位"),
    "conformity": ("Conformity", "符合性判定"),
    "remarks": ("Deviations and remarks", "偏离与说明"),
    "operator": ("Calibrated by", "校准员"),
    "authorised": ("Authorised by", "批准人"),
    "result": ("Result", "结果标识"),
    "result as found": ("Results as found", "校准结果（调整前）"),
    "result as left": ("Results as left", "校准结果（调整后）"),
    "as found": ("As found", "调整前"),
    "as left": ("As left", "调整后"),
    "not observable": ("not observable", "不可观测"),
    "sensor model": ("Sensor model", "传感器模型"),
    "fixed parameters": ("Sensor model: parameters without uncertainty", "传感器模型：无不确定度的参数"),
    "no condition": ("Not recorded", "未记录"),
    "pass": ("Pass", "合格"),
    "conditional pass": ("Conditional pass", "有条件合格"),
    "conditional fail": ("Conditional fail", "有条件不合格"),
    "fail": ("Fail", "不合格"),
    "attached": ("The attached XML holds the same numbers", "附件 XML 含相同数据"),
}
"""Words and short phrases, English and Chinese."""

TERMS: Mapping[str, tuple[str, str]] = {
    "accelerometer": ("Accelerometer", "加速度计"),
    "gyroscope": ("Gyroscope", "陀螺仪"),
    "bias": ("bias", "零偏"),
    "scale": ("scale", "标度因数"),
    "non-orthogonality": ("non-orthogonality", "非正交角"),
    "mounting": ("mounting", "安装角"),
    "g-sensitivity": ("g-sensitivity", "加速度敏感度"),
    "noise-density": ("noise density", "噪声密度"),
    "bias-instability": ("bias instability", "零偏不稳定性"),
    "random-walk": ("random walk", "随机游走"),
}
"""Triads and groups of parameters."""

METHODS: Mapping[str, tuple[str, str]] = {
    "turntable": (
        "Comparison with a co-mounted reference unit at rests and turns on a turntable; least squares.",
        "在转台上与同装参考单元在静止和转动时比较，最小二乘拟合。",
    ),
    "multipose": (
        "Rests in many orientations, against the magnitude of gravity; least squares.",
        "多姿态静置，以重力加速度的模为参考，最小二乘拟合。",
    ),
    "spin": (
        "Rest and turns on the spot of a vehicle, against gravity; least squares.",
        "载体静止并原地旋转，以重力加速度为参考，最小二乘拟合。",
    ),
    "redundancy": (
        "Comparison with the primary of a redundant set in motion; least squares.",
        "运动中与冗余组的主单元比较，最小二乘拟合。",
    ),
    "noise": ("Allan deviation of a recording at rest.", "静态记录的阿伦偏差。"),
    "thermal": (
        "Rests at many temperatures; polynomials of bias and scale.",
        "多温度点静置，零偏和标度因数的多项式拟合。",
    ),
}
"""Method of each procedure."""

SENTENCES: Mapping[str, tuple[str, str]] = {
    "only in full": (
        "This certificate may be reproduced only in full, unless the laboratory agrees in writing.",
        "未经实验室书面同意，不得部分复制本证书。",
    ),
    "only this item": (
        "The results relate only to the item calibrated, on the dates stated.",
        "结果仅对所述日期的被校器具有效。",
    ),
    "model": (
        "The sensor reads y = M u + b, where u is the truth in the frame of the case; M = K L Q: scale, "
        "non-orthogonality, mounting. M and b with their covariance are in the attached XML.",
        "传感器读数 y = M u + b，u 为壳体坐标系中的真值；M = K L Q：标度因数、非正交、安装。"
        "M、b 及其协方差见附件 XML。",
    ),
    "uncertainty": (
        "U is the expanded uncertainty: the standard uncertainty times k, for a coverage probability of 95 % "
        "(JCGM 100). Values without U are for information.",
        "U 为扩展不确定度：标准不确定度乘以 k，包含概率 95 %（JCGM 100）。未给出 U 的值仅供参考。",
    ),
    "rule simple": (
        "Decision rule: simple acceptance; a value within its limit passes, whatever its uncertainty "
        "(ILAC-G8:09, 4.2.1).",
        "判定规则：简单接受；值在限值内即合格，不考虑不确定度（ILAC-G8:09，4.2.1）。",
    ),
    "rule guarded": (
        "Decision rule: guarded acceptance; the acceptance limit is the limit less {guard} U "
        "(ILAC-G8:09, 4.2.3).",
        "判定规则：带保护带的接受；接受限为限值减 {guard} U（ILAC-G8:09，4.2.3）。",
    ),
    "traceable": (
        "Traceable by certificate {certificate} of {laboratory}, calibrated {certified}.",
        "通过 {laboratory} 的证书 {certificate}（{certified} 校准）溯源。",
    ),
    "by data sheet": (
        "The uncertainty of the reference is that of {source}, no certificate: no traceability is claimed.",
        "参考标准的不确定度取自 {source}，无证书：不声明计量溯源性。",
    ),
    "relative": (
        "No uncertainty of the reference is stated: results are relative to it, no traceability is claimed.",
        "未给出参考标准的不确定度：结果相对于参考标准，不声明计量溯源性。",
    ),
    "by gravity": (
        "No reference unit was used; no traceability is claimed.",
        "未使用参考单元；不声明计量溯源性。",
    ),
    "not shown": (
        "The data did not show: {parameters}.",
        "数据不足以确定：{parameters}。",
    ),
    "supersedes": (
        "This certificate replaces certificate {number}.",
        "本证书替代证书 {number}。",
    ),
}

CHINESE_FONTS = (
    "Noto Sans CJK SC",
    "Noto Serif CJK SC",
    "Source Han Sans SC",
    "WenQuanYi Micro Hei",
    "WenQuanYi Zen Hei",
    "Microsoft YaHei",
    "SimSun",
    "PingFang SC",
    "Songti SC",
)
"""Families of fonts with Chinese letters, the preferred ones first."""


def texts(entry: tuple[str, str], languages: Sequence[Language], **values: str) -> Texts:
    """Return a sentence in each language, with values from outside in its places."""
    every = dict(zip(("en", "zh"), entry, strict=True))
    return {language: every[language].format(**values) for language in languages}


def label(key: str, languages: Sequence[Language]) -> Texts:
    """Return a label in each language."""
    return texts(LABELS[key], languages)


def parameter_name(parameter: str, languages: Sequence[Language]) -> Texts:
    """Return `bias x` of `accelerometer bias x` in each language."""
    _, group, axis = parameter.split(" ")
    return {language: f"{name} {axis}" for language, name in texts(TERMS[group], languages).items()}


def languages_of(setting: str) -> tuple[Language, ...]:
    """Return the languages of the setting `language`; raises `TumbleError`."""
    known: dict[str, tuple[Language, ...]] = {"": ("en",), "en": ("en",), "en,zh": ("en", "zh")}
    if setting not in known:
        raise TumbleError(f"--language {setting}: give en or en,zh")
    return known[setting]
