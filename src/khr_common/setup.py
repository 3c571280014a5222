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
        (f'share/{package}/hook', ['hook/arithmetic.dsv']),  # for the colcon.pkg
    ],
    package_data={'': ['py.typed']},
    install_requires=['numpy', 'PyYAML'],
    extras_require={
        'ros': ['ros-jazzy-rclpy[fastrtps]', 'ros-jazzy-common-interfaces'],
        'test': ['hypothesis', 'pytest', 'pytest-timeout'],
    },
)
