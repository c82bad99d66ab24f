# Draws model.glb through one of its cameras to picture.png (Godot 3). See docs/viewer.md.
extends Spatial

const CAMERA = 3

func _ready():
	var document = read_document("res://model.glb")
	var soup = document["extensions"]["TRISOUP_neural_textures"]
	var model = load("res://model.glb").instance()
	add_child(model)
	var mesh = find_mesh(model)
	for i in range(mesh.mesh.get_surface_count()):
		mesh.mesh.surface_get_material(i).flags_unshaded = true  # the importer does not know KHR_materials_unlit
	add_camera(soup, read_pose("res://model.glb", document, soup["cameras"]["poses"]), mesh)
	for _i in range(4):
		yield(get_tree(), "idle_frame")
	yield(VisualServer, "frame_post_draw")
	var image = get_viewport().get_texture().get_data()
	image.flip_y()
	image.save_png("res://picture.png")
	get_tree().quit()

func read_document(path):
	var file = File.new()
	file.open(path, File.READ)
	file.seek(12)
	var length = file.get_32()
	file.get_32()
	return JSON.parse(file.get_buffer(length).get_string_from_utf8()).result

# Reads the pose of the camera: scene to camera, in normalised coordinates (docs/formats.md).
func read_pose(path, document, view):
	var file = File.new()
	file.open(path, File.READ)
	file.seek(12)
	var length = file.get_32()
	file.seek(28 + length + document["bufferViews"][view]["byteOffset"] + 28 * CAMERA)
	var values = []
	for _i in range(7):
		values.append(file.get_float())
	return Transform(Basis(Quat(values[0], values[1], values[2], values[3])), Vector3(values[4], values[5], values[6]))

func find_mesh(node):
	if node is MeshInstance:
		return node
	for child in node.get_children():
		var found = find_mesh(child)
		if found:
			return found
	return null

func add_camera(soup, camera_from_scene, mesh):
	var cameras = soup["cameras"]
	var lens = cameras["lenses"][cameras["lens"][CAMERA] if cameras.has("lens") else 0]
	var pose = camera_from_scene.affine_inverse()
	var centre = soup["centre"]
	pose.origin = pose.origin / soup["scale"] + Vector3(centre[0], centre[1], centre[2])
	pose.basis = pose.basis * Basis(Vector3(1, 0, 0), Vector3(0, -1, 0), Vector3(0, 0, -1))
	var camera = Camera.new()
	add_child(camera)
	camera.global_transform = mesh.global_transform * pose
	camera.fov = rad2deg(2 * atan(0.5 * lens["size"][1] / lens["focal"][1]))
	camera.near = 0.01 / soup["scale"]
	camera.far = 10 / soup["scale"]
	camera.current = true
	camera.environment = Environment.new()
	camera.environment.background_mode = Environment.BG_COLOR
	var colour = soup["background"]
	camera.environment.background_color = Color(colour[0], colour[1], colour[2])
