from xml.etree import ElementTree

from setuptools import find_packages, setup

manifest = ElementTree.parse('package.xml')
package = manifest.findtext('name')
stated = ('name', 'version', 'description', 'license', 'maintainer', 'url')
setup(
    **{key: manifest.findtext(key) for key in stated},
    maintainer_email=manifest.find('maintainer').get('email'),
    packages=find_packages(),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
    ],
    package_data={'': ['py.typed', '*.mplstyle', 'templates/*']},
    install_requires=[
        'khr_common',
        'khr_description',
        'khr_sim',
        'khr_balance',
        'khr_analysis',
        'khr_bringup',
        'khr_sweeps',
        'imageio-ffmpeg',
        'Jinja2',
        'MarkupSafe',
        'markdown-it-py',
        'matplotlib',
        'numpy',
        'pillow',
    ],
    extras_require={'test': ['hypothesis', 'pytest', 'pytest-timeout']},
)
